"""The study as a list of runs: what varies, and what each run is compared with."""

from collections import Counter
from dataclasses import asdict, replace

import pytest

from nmpcrl.claims.reproduce import FEWEST
from nmpcrl.study import Experiment, design, paper
from nmpcrl.study.departures import DEPARTURES
from nmpcrl.study.experiment import MAIN, frozen_arm
from nmpcrl.study.learners import DECAYS


@pytest.fixture(scope="module")
def main_table() -> set[Experiment]:
    return set(design.main_table())


def differing(one: Experiment, other: Experiment) -> set[str]:
    first, second = asdict(one), asdict(other)
    return {name for name in first if first[name] != second[name]}


def test_the_main_table_has_every_learner_layout_reading_and_seed():
    runs = design.main_table()
    assert len(runs) == len(set(runs)) == len(MAIN) * 6 * 2 * 10
    assert {e.episodes for e in runs} == {paper.EPISODES}
    default = Experiment()
    assert all(differing(e, default) <= {"learner", "layout", "decay", "seed"} for e in runs)


def test_the_study_begins_with_the_main_table_and_names_every_run_once():
    study = design.whole_study()
    names = list(study.values())
    main = len(design.main_table())
    assert set(names[:main]) == {design.MAIN_TABLE}
    assert design.MAIN_TABLE not in names[main:]
    assert set(names) == {design.MAIN_TABLE, "controls", *design.VARIANTS}


def test_what_is_trained_afresh_meets_every_layout_and_both_readings_with_every_learner():
    """So that the learners of a cell can be compared, and a check of ranges has enough seeds."""
    fresh = set(design.fresh())
    assert fresh < set(design.main_table())
    cells = Counter((e.layout, e.decay, e.seed) for e in fresh)
    assert set(cells.values()) == {len(MAIN)}
    assert {layout for layout, _, _ in cells} == set(design.LAYOUTS)
    seeds = Counter((layout, decay) for layout, decay, _ in cells)
    assert [seeds["A", decay] for decay in design.DECAYS] == [FEWEST, FEWEST]
    elsewhere = Counter(decay for layout, decay in seeds if layout != "A")
    assert sorted(elsewhere.values()) == [2, 3]


def test_every_run_of_the_study_has_its_frozen_arm_in_the_study():
    study = design.whole_study()
    assert {frozen_arm(e) for e in study} <= set(study)


MAIN_AXES = {"decay", "layout"}  # which the main table varies itself


def base_of(experiment: Experiment, name: str) -> Experiment:
    """The run of the main table that a run of variant `name` is compared with."""
    default = Experiment()
    changed = {
        key: getattr(default, key) for key in design.VARIANTS[name].fields if key not in MAIN_AXES
    }
    return replace(experiment, **changed)


@pytest.mark.parametrize("name", design.VARIANTS)
def test_a_variant_changes_one_thing(name, main_table):
    variant = design.VARIANTS[name]
    for experiment in design.variant(name):
        if experiment.learner != "frozen":
            base = base_of(experiment, name)
            assert differing(experiment, base) == set(variant.fields) - MAIN_AXES
            assert base in main_table


@pytest.mark.parametrize("name", design.BASELINES)
def test_what_is_open_of_des_is_run_on_every_layout_in_both_readings(name, main_table):
    runs = design.variant(name)
    learning = [one for one in runs if one.learner != "frozen"]
    axes = Counter((one.layout, one.decay) for one in learning)
    assert axes == Counter({(layout, decay): 5 for layout in "ABCDEF" for decay in DECAYS})
    assert {(one.learner, one.network) for one in learning} == {("DES", name)}
    assert set(runs) - set(learning) < main_table
    study = design.whole_study()
    assert {study[one] for one in learning} == {name}
    assert {study[one] for one in set(runs) - set(learning)} == {design.MAIN_TABLE}


def test_variants_name_departures_that_there_are_and_no_two_are_the_same():
    letters = {variant.departure for variant in design.VARIANTS.values()} - {""}
    assert letters <= set(DEPARTURES)
    fields = Counter(str(sorted(dict(v.fields).items())) for v in design.VARIANTS.values())
    assert max(fields.values()) == 1


def test_a_frozen_arm_meets_the_same_noise_and_ignores_what_only_learning_uses():
    run = Experiment("GES", seed=3, layout="D", decay="episode", beta=1.0, alpha=2.0, horizon=5)
    arm = frozen_arm(run)
    assert differing(run, arm) == {"learner", "alpha", "beta"}
    assert frozen_arm(arm) == arm
