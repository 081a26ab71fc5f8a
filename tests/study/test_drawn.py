"""No layout was picked: a seeded sampler draws the same layouts again."""

from collections.abc import Iterator
from itertools import combinations, islice

import numpy as np
import pytest

from nmpcrl.study import Experiment, paper
from nmpcrl.study.drawn import COMPARED, JUDGE, LAYOUTS, SCENARIOS, TUNE, name_of
from nmpcrl.study.geometry import Centres
from nmpcrl.study.layouts import screen

AREA = ((-1.5, -1.5), (7.5, 5.0))  # of the centres [m]
APART = 2.2  # least distance of two centres [m]: no disc touches another


def drawn(seed: int) -> Iterator[Centres]:
    """Four centres each, `APART` from each other and rounded to 0.1 m, that pass the screening."""
    rng = np.random.default_rng(seed)
    while True:
        centres = np.round(rng.uniform(*AREA, (4, 2)), 1)
        apart = [np.linalg.norm(one - other) for one, other in combinations(centres, 2)]
        layout = tuple((x, y) for x, y in sorted(centres.tolist()))
        if min(apart) >= APART and screen(layout).passed:
            yield layout


def test_the_named_layouts_after_a_are_the_first_until_there_are_three_of_either_kind():
    a, *others = paper.LAYOUTS.values()
    assert screen(a).passed
    found, sequence = [a], drawn(0)
    while len(found) < 6:
        layout = next(sequence)
        if [screen(one).kind for one in found].count(screen(layout).kind) < 3:
            found.append(layout)
    assert found[1:] == others


@pytest.mark.parametrize(
    "count", [6, pytest.param(180, marks=[pytest.mark.weekly, pytest.mark.slow])]
)
def test_the_population_is_the_first_that_are_drawn_and_pass(count):
    assert [*islice(drawn(24), count)] == [*LAYOUTS.values()][:count]


def test_there_are_60_layouts_to_tune_on_120_to_judge_on_and_40_scenarios():
    assert (len(TUNE), len(JUDGE), len({*SCENARIOS.values()})) == (60, 120, 40)
    assert len({*LAYOUTS.values(), *paper.LAYOUTS.values()}) == 180 + len(paper.LAYOUTS)
    assert name_of(Experiment(layout=JUDGE["J001"]).layout) == "J001"


@pytest.mark.slow
def test_the_compared_layouts_are_the_first_of_either_kind():
    kinds = {name: screen(centres).closing for name, centres in JUDGE.items()}
    closing = [name for name in kinds if kinds[name]][:15]
    others = [name for name in kinds if not kinds[name]][:15]
    assert tuple(sorted(closing + others)) == COMPARED
