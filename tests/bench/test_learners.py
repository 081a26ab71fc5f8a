"""Table II: what is counted, never how fast this machine is."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.bench import learners
from nmpcrl.study import paper


@pytest.fixture(scope="module")
def timings() -> pd.DataFrame:
    return learners.time_learners(("ES", "GES", "RDES"), ("fatrop",), steps=5)


def test_there_is_a_row_for_every_learner_and_solver(timings):
    assert list(zip(timings.solver, timings.learner, strict=True)) == [
        ("fatrop", "ES"),
        ("fatrop", "GES"),
        ("fatrop", "RDES"),
    ]


def test_es_and_ges_solve_twice_a_step_and_rdes_once(timings):
    assert list(timings.solves) == [2, 2, 1]


def test_only_a_learner_with_a_network_has_a_time_to_fit(timings):
    assert list(np.isnan(timings.ms_per_fit)) == [True, True, False]


def test_the_hours_are_the_step_s_time_over_the_paper_s_training(timings):
    steps = paper.EPISODES * paper.STEPS
    assert timings.hours.to_numpy() == pytest.approx(timings.ms_per_step * steps / 3.6e6)


def test_the_paper_s_hours_stand_beside_ours_and_are_missing_where_it_gives_none(timings):
    assert list(timings.hours_paper) == [18, 18, 9]
    assert "DES" not in learners.PAPER_HOURS


def test_a_ratio_is_taken_within_one_solver():
    times = pd.DataFrame(
        {
            "solver": ["fatrop", "fatrop", "ipopt", "ipopt"],
            "learner": ["ES", "RDES", "ES", "RDES"],
            "ms_per_step": [2.0, 3.0, 10.0, 6.0],
        }
    )
    assert learners.ratio(times, "fatrop", "RDES") == pytest.approx(1.5)
    assert learners.ratio(times, "ipopt", "RDES") == pytest.approx(0.6)
    assert learners.ratio(times, "ipopt", "ES", reference="RDES") == pytest.approx(10 / 6)
