"""Sets of runs: sweeps, replicas, and the study with what each run is compared with."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from nmpcrl.study import Experiment, ParameterError, design, sweep
from nmpcrl.study.experiment import MAIN, frozen_arm

TABLE = set(design.main_table())
STUDY = design.whole_study()
MAIN_AXES = {"decay", "layout"}  # which the main table varies itself
DRAWN = ((0.5, 2.2), (3.0, 0.5))


def differing(one: Experiment, other: Experiment) -> set[str]:
    first, second = asdict(one), asdict(other)
    return {name for name in first if first[name] != second[name]}


def test_a_sweep_is_every_combination_in_order():
    found = sweep(learner=("ES", "GES"), seed=[0, 1], episodes=20)
    assert [(e.learner, e.seed) for e in found] == [("ES", 0), ("ES", 1), ("GES", 0), ("GES", 1)]
    assert {e.episodes for e in found} == {20}


@pytest.mark.parametrize("one", [DRAWN, np.array(DRAWN), "0.5,2.2 3,0.5"])
def test_a_vector_and_a_layout_are_one_value_of_a_sweep(one):
    assert {e.layout for e in sweep(layout=one, seed=[0, 1])} == {"0.5,2.2 3,0.5"}
    assert [e.layout for e in sweep(layout=["A", DRAWN])] == ["A", "0.5,2.2 3,0.5"]
    (only,) = sweep(start=[0, 1, 2], target=(1.0, 1.0, 0.0), theta=[2.0] * 9)
    assert (only.start, only.target, only.theta) == ((0, 1, 2), (1, 1, 0), (2.0,) * 9)


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ({"seed": range(9_999), "learner": ("ES", "GES")}, "make 19,998 runs; 10,000 are allowed"),
        ({"seed": (3, 3)}, "seeds = (3, 3) must be a list of 1 to 10000 different seeds"),
        ({"layout": ["A", "A"]}, "layouts = ['A', 'A'] must be a list of 1 to 10000 different"),
        ({"seed": [range(10**9)]}, "seed = range(0, 1000000000) must be a whole number"),
        ({"seed": "[3]"}, "seeds = '[3]' arrived as text; write -y '{seeds: [3]}'"),
        ({"theta": "[2.0]"}, "theta = '[2.0]' must be 9 numbers"),
        ({"episode": 3}, f"'episode' is not a parameter; there are {', '.join(design.FIELDS)}"),
    ],
)
def test_a_sweep_refuses_axes(axes, said):
    with pytest.raises(ParameterError) as caught:
        sweep(**axes)
    assert said in str(caught.value)


def test_a_replica_differs_in_the_twelfth_digit_of_theta_x():
    experiment, replica = Experiment(), design.perturbed(Experiment())
    moved = np.array(replica.theta) - experiment.theta
    assert moved.tolist() == [pytest.approx(design.PERTURBATION, rel=1e-3), *[0] * 8]
    assert differing(experiment, replica) == {"theta"}


def test_the_study_begins_with_the_main_table_and_names_every_run_once():
    assert len(TABLE) == len(design.main_table()) == len(MAIN) * 6 * 2 * 10
    default, axes = Experiment(), {"learner", "layout", "decay", "seed"}
    assert all(differing(e, default) <= axes for e in TABLE)
    names = list(STUDY.values())
    assert set(names[: len(TABLE)]) == {design.MAIN_TABLE}
    assert set(names[len(TABLE) :]) == {"controls", *design.VARIANTS}
    assert {frozen_arm(e) for e in STUDY} <= set(STUDY)


@pytest.mark.parametrize("name", design.VARIANTS)
def test_a_variant_changes_one_thing(name):
    variant, default = design.VARIANTS[name], Experiment()
    changed = set(variant.fields) - MAIN_AXES
    for experiment in design.variant(name):
        if experiment.learner != "frozen":
            base = replace(experiment, **{key: getattr(default, key) for key in changed})
            assert differing(experiment, base) == changed
            assert base in TABLE
