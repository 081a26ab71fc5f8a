"""What is asked of worlds that change is complete, and within its price."""

from nmpcrl.analysis.shifts import RATES
from nmpcrl.analysis.worlds import JOBS
from nmpcrl.claims import world_runs
from nmpcrl.claims.world_questions import (
    CHANGES,
    DEVIATIONS,
    ORACLES,
    PARTS,
    REMEDY,
    VIEWS,
    WITHOUT,
)
from nmpcrl.study.faults import FAULTS
from nmpcrl.study.motions import PREDICTORS
from nmpcrl.study.population import JUDGE
from nmpcrl.study.scenarios import load


def test_every_part_is_one_that_can_be_run_in_places_that_there_are():
    assert {*world_runs.PARTS} == {*JOBS}
    assert {*CHANGES} == {*RATES}
    assert PARTS["moving"].places == tuple(load())
    for name in ("model", "carry", "gradient"):
        assert {*PARTS[name].places} <= {*JUDGE}
    assert PARTS["carry"].places == tuple(JUDGE)


def test_the_arms_are_what_can_be_run():
    assert {*VIEWS} == {*PREDICTORS}
    assert {*ORACLES, *WITHOUT} == {*FAULTS}
    assert all(float(one) > 0 for one in DEVIATIONS)
    for part in PARTS.values():
        assert len({*part.arms}) == len(part.arms)
        assert {*part.once, *part.fewer} <= {*part.arms}


def test_an_arm_that_draws_nothing_is_run_once_and_all_others_with_every_seed():
    moving = PARTS["moving"]
    assert len(moving.runs("known init")) == 40
    assert moving.runs("known ES")[:6] == (*(("M01", k) for k in range(5)), ("M02", 0))
    assert len(PARTS["carry"].runs("frozen")) == 1
    assert len(PARTS["once"].runs(REMEDY)) == 10
