"""Times of problems: whole, sealed, and kept in the order in which they were measured."""

import json
from itertools import count

import pandas as pd
import pytest

from nmpcrl.bench import problem_times, processes
from nmpcrl.bench.problem_sizes import VARIED, Sizes

TIMES = ["first_s", "solve_us", "iterations", "hessian_us", "policy_us", "fatrop_us"]


@pytest.fixture
def found(tmp_path, monkeypatch):
    """Times of which each call gives others, so that what was measured twice would show."""
    calls = count(1.0)
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    monkeypatch.setattr(
        processes, "problem_of_sizes", lambda sizes: dict.fromkeys(TIMES, next(calls))
    )
    peers = pd.DataFrame({"problem": ["one"], "run_s": [2.0]})
    monkeypatch.setattr(problem_times, "beside_mpcrl", lambda: peers)
    return problem_times.make(progress=False)


def test_every_size_has_all_its_times(found):
    sizes = [(name, size) for name, values in VARIED.items() for size in values]
    assert list(zip(found.sizes.varied, found.sizes["size"], strict=True)) == sizes
    assert (found.sizes[TIMES] > 0).all(axis=None)


def test_what_has_the_same_sizes_was_measured_once(found):
    rows = found.sizes[found.sizes["size"] == [getattr(Sizes(), one) for one in found.sizes.varied]]
    assert len(rows) == len(VARIED)
    assert (rows[TIMES].nunique() == 1).all()


def test_what_is_measured_is_kept_and_read(found):
    again = problem_times.read(problem_times.path())
    pd.testing.assert_frame_equal(again.sizes, found.sizes)
    assert again.peers.problem.tolist() == ["one"]
    assert again.about == found.about


def test_times_that_were_changed_are_refused(found, tmp_path):
    content = json.loads(problem_times.path().read_text())
    content["peers"]["run_s"][0] /= 2
    (tmp_path / "x.json").write_text(json.dumps(content))
    with pytest.raises(problem_times.DamagedTimes, match=r"not the file that was written.*--sizes"):
        problem_times.read(tmp_path / "x.json")
    with pytest.raises(problem_times.DamagedTimes, match="missing or damaged"):
        problem_times.read(tmp_path / "none.json")


def test_a_size_is_measured_in_a_process_that_keeps_nothing(monkeypatch):
    asked = []
    monkeypatch.setattr(processes, "_alone", lambda *words: (asked.append(words) or {}, ""))
    assert processes.problem_of_sizes(Sizes(states=2)) == {}
    assert asked == [("sizes", "2", "1", "10", "8", "2")]
