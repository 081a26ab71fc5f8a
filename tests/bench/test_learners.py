"""Table II: what is counted, never how fast this machine is."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.bench import learners
from nmpcrl.bench.paired import Ratio
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
    names = ["ratio", "ratio_low", "ratio_high", "waited"]
    rows = [(1.0, 1.0, 1.0, 0.0), (1.5, 1.4, 1.6, 0.1), (1.0, 1.0, 1.0, 0.0), (0.6, 0.5, 0.7, 0.2)]
    times = pd.DataFrame(rows, columns=names)
    times["solver"] = ["fatrop", "fatrop", "ipopt", "ipopt"]
    times["learner"] = ["ES", "RDES", "ES", "RDES"]
    assert learners.ratio(times, "fatrop", "RDES") == Ratio(1.5, 1.4, 1.6, 0.1)
    assert learners.ratio(times, "ipopt", "RDES") == Ratio(0.6, 0.5, 0.7, 0.2)
    with pytest.raises(KeyError):
        learners.ratio(times, "ipopt", "GES")


def test_es_is_as_fast_as_itself_and_few_steps_have_no_interval(timings):
    table = timings.set_index("learner")
    assert table.ratio["ES"] == 1
    assert table[["ratio_low", "ratio_high"]].isna().all(axis=None)
    assert table.waited.between(0, 1).all()


def test_without_es_there_is_nothing_to_compare_with():
    table = learners.time_learners(("GES",), ("riccati",), steps=2)
    assert table[learners.COMPARED].isna().all(axis=None)


def test_the_parts_of_a_step_add_up_to_the_processor_s_time_however_long_it_waited():
    steps = [[2.0, 0.4, 0.2, 2.0, 1.0]] * 2 + [[2.0, 8.0, 0.2, 10.0, 5.0]]  # half was another's
    made = learners._means(np.array(steps).T)
    assert made["ms_per_step"] == pytest.approx(7e3 / 3)
    told = made["solves"] * made["ms_per_solve"] + made["ms_per_fit"] + made["ms_per_rest"]
    assert told == pytest.approx(made["ms_per_step"])


def test_the_ratio_is_what_the_times_of_the_same_table_divide_to(timings):
    step = timings.set_index(["solver", "learner"]).ms_per_step
    for solver, learner in step.index:
        stated = learners.ratio(timings, solver, learner).value
        assert stated == pytest.approx(step[solver, learner] / step[solver, "ES"])
