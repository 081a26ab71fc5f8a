"""Forty kills of a study at random moments: nothing stored is lost, and no number is wrong."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from made_records import assert_same_numbers

from nmpcrl.analysis.summaries import SUMMARIES
from nmpcrl.analysis.summary import RunSummary, summarise
from nmpcrl.study import run, sweep

KILLS, PATIENCE = 40, 600.0  # [s]
RUNS = sweep(learner=("ES", "RDES"), seed=tuple(range(20)), episodes=1, steps=40)
PROGRAM = """
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.study import sweep

runs = sweep(learner=("ES", "RDES"), seed=tuple(range(20)), episodes=1, steps=40)
assert len(fetch_summaries(runs, workers=2, progress=False)) == len(runs)
"""


def start() -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM], start_new_session=True, stderr=subprocess.DEVNULL
    )


def stored(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.glob("*.npz")}


@pytest.mark.slow
@pytest.mark.weekly
def test_forty_kills_at_random_moments_lose_nothing_and_nothing_wrong_is_believed(runs):
    rng, folder = random.Random(0), runs / "summaries"
    truth = {SUMMARIES.path_of(one): summarise(run(one)) for one in RUNS}
    program, end, believed = start(), time.monotonic() + PATIENCE, dict[Path, int]()
    for _ in range(KILLS):
        time.sleep(rng.uniform(0.2, 6.0))
        children = psutil.Process(program.pid).children() if program.poll() is None else []
        victim = rng.choice([program.pid, *(one.pid for one in children)])
        if program.poll() is None:
            os.kill(victim, signal.SIGKILL)
        if victim == program.pid:
            program.wait()
            if believed.keys() == truth.keys():
                believed.clear()
                for path in folder.glob("*.npz"):
                    path.unlink()
            program = start()
        found = stored(folder)
        assert found.items() >= believed.items()  # neither lost nor made again
        for path in found.keys() - believed.keys():
            assert_same_numbers(RunSummary.load(path), truth[path])
        believed = found
        assert time.monotonic() < end
    assert program.wait(120) == 0
    for path, one in truth.items():
        assert_same_numbers(RunSummary.load(path), one)
