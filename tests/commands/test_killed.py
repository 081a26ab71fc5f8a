"""An investigation and runs that are killed forty times end with the numbers of an undisturbed one.

A child process completes the investigation of Chapter 9 with longer rows, and some runs. The child,
one of its workers or all of them are killed after a drawn number of stored values and a drawn time,
and the child is started again. No stored value is lost or made again.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
import pytest
from builders import assert_same_numbers, own_investigation

from nmpcrl.studies.investigation import of_file
from nmpcrl.study import fetch_all, sweep
from nmpcrl.study.store import RUNS

KILLS = 40
STUDY = sweep(learner=("ES", "frozen"), seed=range(6), episodes=10)
PROGRAM = """
import sys
from pathlib import Path
from nmpcrl.studies.investigation import of_file
from nmpcrl.study import fetch_all, sweep
print(flush=True)
fetch_all(sweep(learner=("ES", "frozen"), seed=range(6), episodes=10), workers=2, progress=False)
of_file(Path(sys.argv[1])).complete(workers=2)
"""


@pytest.fixture
def own(tmp_path) -> Path:
    path = tmp_path / "chain.py"
    text, found = re.subn(r"(GAMMA, ALPHA, UPDATES = .*), 600", r"\1, 8_000", own_investigation())
    assert found
    path.write_text(text)
    return path


def begun(own: Path, runs: Path) -> subprocess.Popen:
    """The child, in a session of its own, once it has imported its libraries."""
    environment = os.environ | {"NMPCRL_RUNS": str(runs), "PYTHONPATH": str(Path.cwd())}
    child = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(own)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    with child.stdout as said:
        said.readline()
    return child


def stored(runs: Path) -> dict[str, object]:
    """Complete rows by key, and the time at which each run was stored."""
    log, found = runs / "chain.jsonl", {}
    for line in log.read_text().splitlines() if log.exists() else ():
        with suppress(ValueError):
            key, *row = json.loads(line)
            assert key not in found, "a row was made twice"
            found[key] = row
    return found | {path.name: path.stat().st_mtime_ns for path in runs.glob("*.npz")}


def wait_for(child: subprocess.Popen, runs: Path, count: int) -> None:
    """Wait until so many values are stored, or the child ends."""
    while child.poll() is None and len(stored(runs)) < count:
        time.sleep(0.02)


def kill(child: subprocess.Popen, rng: np.random.Generator) -> None:
    """Kill the child, one of its processes, or all."""
    with suppress(ProcessLookupError, psutil.NoSuchProcess):
        processes = psutil.Process(child.pid).children(recursive=True)
        match rng.choice(["child", "worker", "all"]):
            case "worker" if processes:
                processes[rng.integers(len(processes))].kill()
            case "all":
                os.killpg(child.pid, signal.SIGKILL)
            case _:
                child.kill()


def by_arm(table) -> list[float]:
    return table.sort_values(["arm", "k"]).end.tolist()


@pytest.mark.weekly
@pytest.mark.skipif(not hasattr(os, "killpg"), reason="this system has no sessions")
def test_forty_kills_lose_nothing_and_change_no_number(own, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "undisturbed"))
    assert begun(own, tmp_path / "undisturbed").wait() == 0
    table, records = of_file(own).made(), fetch_all(STUDY)
    rng, kills, rounds, child = np.random.default_rng(42), 0, 0, None
    while kills < KILLS or child:
        runs = tmp_path / f"runs {rounds}"
        child = child or begun(own, runs)
        before = stored(runs)
        if kills == KILLS:
            child.wait()
        wait_for(child, runs, len(before) + rng.integers(4))
        time.sleep(rng.exponential(0.3))
        if child.poll() is None:
            kill(child, rng)
            kills += 1
            time.sleep(0.2)
        assert before.items() <= stored(runs).items(), "something was lost or made again"
        if child.poll() == 0:
            monkeypatch.setenv("NMPCRL_RUNS", str(runs))
            assert by_arm(of_file(own).made()) == by_arm(table)
            assert all(map(RUNS.read, STUDY))
            for one, found in fetch_all(STUDY).items():
                assert_same_numbers(found, records[one])
            rounds, child = rounds + 1, None
        elif child.poll() is not None:
            assert child.returncode == -signal.SIGKILL
            child = begun(own, runs)
