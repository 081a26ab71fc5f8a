"""Table II: what is counted, never how fast this machine is."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.bench import learners
from nmpcrl.bench.paired import Ratio


@pytest.fixture(scope="module")
def timings() -> pd.DataFrame:
    return learners.time_learners(("ES", "GES", "RDES"), ("fatrop",), steps=5)


def test_es_and_ges_solve_twice_a_step_and_rdes_once(timings):
    assert list(timings.solves) == [2, 2, 1]


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


def test_the_parts_of_a_step_add_up_to_the_processor_s_time_however_long_it_waited():
    steps = [[2.0, 0.4, 0.2, 2.0, 1.0]] * 2 + [[2.0, 8.0, 0.2, 10.0, 5.0]]  # half was another's
    made = learners._means(np.array(steps).T)
    assert made["ms_per_step"] == pytest.approx(7e3 / 3)
    told = made["solves"] * made["ms_per_solve"] + made["ms_per_fit"] + made["ms_per_rest"]
    assert told == pytest.approx(made["ms_per_step"])
