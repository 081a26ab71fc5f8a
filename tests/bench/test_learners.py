"""Table II, in this process and in others: what is counted, never how fast this machine is."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.bench import learners
from nmpcrl.bench.paired import Ratio
from nmpcrl.claims import published


@pytest.fixture(scope="module")
def timings() -> pd.DataFrame:
    return learners.time_learners(("ES", "GES", "RDES"), ("fatrop",), steps=5)


def test_es_and_ges_solve_twice_a_step_and_rdes_once(timings):
    assert list(timings.solves) == [2, 2, 1]


def test_a_ratio_is_taken_within_one_solver_and_parts_of_a_step_add_up():
    names = ["ratio", "ratio_low", "ratio_high", "waited"]
    rows = [(1.0, 1.0, 1.0, 0.0), (1.5, 1.4, 1.6, 0.1), (1.0, 1.0, 1.0, 0.0), (0.6, 0.5, 0.7, 0.2)]
    times = pd.DataFrame(rows, columns=names)
    times["solver"] = ["fatrop", "fatrop", "ipopt", "ipopt"]
    times["learner"] = ["ES", "RDES", "ES", "RDES"]
    assert learners.ratio(times, "fatrop", "RDES") == Ratio(1.5, 1.4, 1.6, 0.1)
    assert learners.ratio(times, "ipopt", "RDES") == Ratio(0.6, 0.5, 0.7, 0.2)
    with pytest.raises(KeyError):
        learners.ratio(times, "ipopt", "GES")
    steps = [[2.0, 0.4, 0.2, 2.0, 1.0]] * 2 + [[2.0, 8.0, 0.2, 10.0, 5.0]]  # half was another's
    made = learners._means(np.array(steps).T)
    assert made["ms_per_step"] == pytest.approx(7e3 / 3)
    told = made["solves"] * made["ms_per_solve"] + made["ms_per_fit"] + made["ms_per_rest"]
    assert told == pytest.approx(made["ms_per_step"])


def test_learners_that_are_timed_afresh_are_pooled_over_the_processes(monkeypatch):
    found = iter([0.5, 0.6, 0.72])

    def alone(steps):
        assert steps == 130
        ratio, speed = next(found), 3.0
        each = dict.fromkeys(("ms_per_rest", "ratio_low", "ratio_high", "ms_per_fit"), np.nan)
        each |= {"solver": "ipopt", "ms_per_solve": 0.1, "waited": 0.1}
        es = {"learner": "ES", "solves": 2.0, "ms_per_step": speed, "ratio": 1.0}
        rdes = {"learner": "RDES", "solves": 1.0, "ms_per_step": ratio * speed, "ms_per_fit": 0.2}
        rows = [each | es, each | rdes | {"ratio": ratio}]
        return pd.DataFrame(rows)

    monkeypatch.setattr(learners, "_time_learners", alone)
    es, rdes = learners.time_learners_afresh(3).to_dict("records")
    assert rdes["ratio"] == pytest.approx(0.6)
    assert rdes["ratio_low"] < 0.5
    assert rdes["ratio_high"] > 0.72
    assert rdes["ms_per_step"] / es["ms_per_step"] == pytest.approx(rdes["ratio"])
    assert 0.1 + 0.2 + rdes["ms_per_rest"] == pytest.approx(rdes["ms_per_step"])
    assert np.isnan(es["ms_per_fit"])
    assert 2 * 0.1 + es["ms_per_rest"] == pytest.approx(es["ms_per_step"])


def measurements(seed: int) -> list[pd.DataFrame]:
    """Ten repetitions, of which each says how sure it is; they come apart by as much."""
    rng, tables = np.random.default_rng(seed), []
    for shift in rng.normal(0, 0.01, 10):
        rows = [("ipopt", "ES", 1.0, 1.0, 1.0), ("ipopt", "RDES", *np.exp(shift + WIDE) * 0.6)]
        table = pd.DataFrame(
            rows, columns=["solver", "learner", "ratio", "ratio_low", "ratio_high"]
        )
        parts = {"solves": 1.0, "ms_per_solve": 0.1, "ms_per_fit": np.nan, "ms_per_rest": 0.1}
        tables.append(table.assign(ms_per_step=table.ratio, waited=0.0, **parts))
    return tables


WIDE = np.array([0.0, -0.02, 0.02])  # of a repetition's own interval: two standard errors


def test_repetitions_say_how_many_of_their_intervals_hold_the_whole_and_published_ones_nine():
    found = [learners.repeated(measurements(seed)).iloc[1] for seed in range(20)]
    assert {one.repetitions for one in found} == {10}
    assert np.mean([one.inside for one in found]) == pytest.approx(9.5, abs=0.4)
    held = [one.ratio_low <= 0.6 <= one.ratio_high for one in found]
    assert np.mean(held) >= 0.85
    assert all(one.ratio == pytest.approx(one.ms_per_step) for one in found)
    timings = published.load().timings
    assert set(timings.repetitions) == {learners.REPETITIONS}
    assert timings.inside.min() >= 9


@pytest.mark.slow
def test_a_process_of_its_own_hands_back_the_table():
    table = learners._time_learners(2)
    assert len(table) == 3 * 4
    assert list(table.ms_per_fit.isna()) == [True, True, False, False] * 3
