"""What is measured in processes of its own; how long it takes, no test says."""

import os

import numpy as np
import pandas as pd
import pytest

from nmpcrl.bench import fresh_process, processes
from nmpcrl.claims import published


@pytest.mark.slow
def test_a_whole_run_reports_every_episode():
    totals, progress = processes.whole_runs(("frozen",), episodes=3)
    assert totals["learner"] == ["frozen"]
    assert totals["episodes"] == [3]
    assert progress["episode"] == [1, 2, 3]
    assert sorted(progress["seconds"]) == progress["seconds"]
    assert progress["seconds"][-1] <= totals["seconds"][0]
    assert min(progress["memory"]) > 10_000_000


@pytest.mark.slow
def test_runs_at_once_leave_neither_files_nor_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    before = dict(os.environ)
    measured = processes.at_once(runs=2, episodes=1)
    assert measured["workers"] == sorted({1, os.cpu_count()})
    assert min(measured["seconds"]) > 0
    assert not list(tmp_path.iterdir())
    assert dict(os.environ) == before


def test_learners_that_are_timed_afresh_are_pooled_over_the_processes(monkeypatch):
    found = iter([0.5, 0.6, 0.72])

    def alone(what, steps):
        assert (what, steps) == ("steps", "130")
        ratio, speed = next(found), 3.0
        each = {"ms_per_solve": 0.1, "ms_per_rest": np.nan, "ratio_low": None, "ratio_high": None}
        rows = [
            {"learner": "ES", "solves": 2.0, "ms_per_step": speed, "ms_per_fit": None, "ratio": 1},
            {
                "learner": "RDES",
                "solves": 1.0,
                "ms_per_step": ratio * speed,
                "ms_per_fit": 0.2,
                "ratio": ratio,
            },
        ]
        rows = [{"solver": "ipopt"} | row | each | {"waited": 0.1} for row in rows]
        return {name: [row[name] for row in rows] for name in rows[0]}, ""

    monkeypatch.setattr(processes, "_alone", alone)
    es, rdes = processes.time_learners_afresh(3).to_dict("records")
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


def test_repetitions_say_how_many_of_their_intervals_hold_the_whole():
    found = [processes.repeated(measurements(seed)).iloc[1] for seed in range(20)]
    assert {one.repetitions for one in found} == {10}
    assert np.mean([one.inside for one in found]) == pytest.approx(9.5, abs=0.4)
    held = [one.ratio_low <= 0.6 <= one.ratio_high for one in found]
    assert np.mean(held) >= 0.85
    assert all(one.ratio == pytest.approx(one.ms_per_step) for one in found)


def test_at_least_nine_of_ten_published_repetitions_hold_what_they_come_to():
    timings = published.load().timings
    assert set(timings.repetitions) == {processes.REPETITIONS}
    assert timings.inside.min() >= 9


def test_no_runs_at_once_are_no_rows():
    assert not any(processes.at_once(runs=0, episodes=1).values())


@pytest.mark.slow
def test_a_first_call_with_machine_code_kept_says_nothing():
    fresh_process.first_call()  # keeps it
    measured = processes.first_calls(1, compile_too=False)
    assert measured["cached"] == [True]
    assert measured["notice"] == [False]
    assert measured["process"][0] > measured["solve"][0] > 0


@pytest.mark.slow
def test_a_measurement_that_fails_says_which_and_why():
    with pytest.raises(RuntimeError, match=r"measuring run SARSA 1 failed(.|\n)*SARSA"):
        processes._alone("run", "SARSA", "1")
