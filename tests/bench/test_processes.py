"""What is measured in processes of its own; how long it takes, no test says."""

import os

import pytest

from nmpcrl.bench import fresh_process, processes


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
        numbers = {"ms_per_step": next(found), "ms_per_fit": None}
        times = {"ratio": numbers["ms_per_step"], "ratio_low": None, "ratio_high": None}
        columns = {"solver": "ipopt", "learner": "RDES"} | numbers | times | {"waited": 0.1}
        return {name: [value] for name, value in columns.items()}, ""

    monkeypatch.setattr(processes, "_alone", alone)
    (row,) = processes.time_learners_afresh(3).to_dict("records")
    assert row["ms_per_step"] == 0.6
    assert row["ratio"] == pytest.approx(0.6)
    assert row["ratio_low"] < 0.5
    assert row["ratio_high"] > 0.72
    assert row["ms_per_fit"] != row["ms_per_fit"]


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
