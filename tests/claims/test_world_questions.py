"""What is asked of worlds that change: complete, within its price, and not moved since."""

from pathlib import Path

from fixed_questions import assert_older, assert_unmoved

from nmpcrl.analysis.shifts import RATES
from nmpcrl.analysis.worlds import JOBS
from nmpcrl.claims import world_questions, world_runs
from nmpcrl.claims.world_questions import (
    CHANGES,
    DEVIATIONS,
    ORACLES,
    PARTS,
    REMEDY,
    VIEWS,
    WITHOUT,
    WORLD_QUESTIONS,
)
from nmpcrl.study.faults import FAULTS
from nmpcrl.study.motions import PREDICTORS
from nmpcrl.study.population import JUDGE
from nmpcrl.study.scenarios import load

FILE = Path(world_questions.__file__)


def test_the_questions_are_those_of_the_commit_that_added_them():
    assert_unmoved(FILE)


def test_the_questions_are_older_than_the_runs_that_are_published():
    assert_older(FILE, "book/published/worlds.json")


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


def test_a_question_says_how_it_is_decided():
    for one in WORLD_QUESTIONS.values():
        assert one.question.endswith("?")
        assert all((one.asked_of, one.measured, one.border))
        assert one.pilot == "" or one.pilot.endswith(".")
    assert sum(one.pilot != "" for one in WORLD_QUESTIONS.values()) == 6
