"""Layouts and scenarios: drawn again, in their order, and screened as the module says."""

from collections import Counter
from itertools import combinations, islice

import numpy as np
import pytest

from nmpcrl.studies import drawing
from nmpcrl.studies.drawing import accepted, draw, layout_sampler, scenario_sampler
from nmpcrl.study import Experiment, design, paper
from nmpcrl.study.drawn import FOLDER, JUDGE, LAYOUTS, SCENARIOS, TUNE
from nmpcrl.study.layouts import screen
from nmpcrl.study.moving import KINDS, still


def test_a_sampler_repeats_itself_and_its_layouts_are_apart_in_the_area_and_on_the_grid():
    some = list(islice(layout_sampler(3), 50))
    assert some == list(islice(layout_sampler(3), 50))
    assert some != list(islice(layout_sampler(4), 50))
    least, most = np.transpose(drawing.AREA)
    for centres in map(np.array, some):
        assert centres.shape == (4, 2)
        for one, other in combinations(centres, 2):
            assert np.linalg.norm(one - other) >= drawing.APART
        assert (least <= centres).all()
        assert (centres <= most).all()
        assert np.allclose(np.round(centres, 1), centres, atol=1e-9)


def test_the_named_layouts_are_the_first_that_are_drawn_and_pass():
    named = {name: paper.LAYOUTS[name] for name in design.LAYOUTS}
    assert Counter(screen(centres).kind for centres in named.values()) == drawing.NAMED
    first = named.pop("A")
    assert screen(first).passed
    assert drawing.named() == named


def test_the_population_has_60_layouts_to_tune_on_and_120_to_judge_on():
    assert (len(TUNE), len(JUDGE)) == (60, 120)
    assert tuple(LAYOUTS) == (*TUNE, *JUDGE) == drawing.names()
    assert len({*LAYOUTS.values(), *paper.LAYOUTS.values()}) == 180 + len(paper.LAYOUTS)
    assert [*islice(drawing.population(), 6)] == [*LAYOUTS.values()][:6]
    assert all(screen(LAYOUTS[name]).passed for name in ("T60", "J001", "J120"))
    assert paper.centres_of(Experiment(layout=JUDGE["J001"]).layout) == JUDGE["J001"]


def test_there_are_forty_different_scenarios_in_the_order_of_the_draws():
    assert len({*SCENARIOS.values()}) == drawing.COUNT == 40
    assert list(SCENARIOS)[::39] == ["M01", "M40"]
    assert {*Counter(map(len, SCENARIOS.values()))} == {3, 4, 5, 6}
    drawn = [*islice(scenario_sampler(), 60)]
    where = [drawn.index(one) for one in SCENARIOS.values() if one in drawn]
    assert where == sorted(where)
    assert len(where) == drawing.COUNT


@pytest.mark.parametrize(
    "layout",
    [
        [(-2.5, 1.5), (3.0, 4.9), (3.0, -1.5), (5.0, -1.5)],  # on the start
        [(3.0, 4.9), (0.0, 4.9), (5.0, -1.5), (3.0, -1.5)],  # nothing in the way
    ],
)
def test_a_scenario_is_screened(layout):
    assert not accepted(still(layout))


@pytest.mark.weekly
@pytest.mark.slow
def test_all_are_drawn_again(tmp_path):
    drawing.write(tmp_path)
    for name in ("population.json", "scenarios.json"):
        assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes()


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_seed_draws_the_same_motion_with_the_drawn_mean_speed(kind):
    def drawn(seed, speed=0.3):
        return draw(np.random.default_rng(seed), kind, (2.0, 1.0), speed=speed, spread=0.0)

    assert drawn(4) == drawn(4) != drawn(5)
    assert isinstance(drawn(4), KINDS[kind])
    times = np.arange(0, 20, 1e-2)
    lengths = np.linalg.norm(np.diff(drawn(4)(times), axis=0), axis=1)
    least, most = (0.295, 0.305) if kind != "polynomial" else (0.295, 0.3 * np.hypot(1, 1.5 + 1.5))
    assert least <= lengths.sum() / 20 <= most
