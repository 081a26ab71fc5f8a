"""A study on a Dask scheduler and two workers of this machine, which share no folder with it."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from made_records import assert_same_numbers

from nmpcrl.analysis.summaries import SUMMARIES, fetch_summaries
from nmpcrl.analysis.summary import summarise
from nmpcrl.study import cluster, run, sweep
from nmpcrl.study.refusal import Refusal

pytest.importorskip("distributed", reason="needs the extra nmpcrl[cluster]")

SIX = sweep(learner=("ES", "RDES"), seed=(0, 1, 2), episodes=1, steps=20)
NOTING = """
import os, time
from pathlib import Path
from nmpcrl.study import run, store

FOLDER = Path({folder!r})


def noting(experiment):
    (FOLDER / f"began-{{experiment.learner}}{{experiment.seed}}-{{os.getpid()}}").touch()
    while len(list(FOLDER.glob("began-*"))) > 2 and not (FOLDER / "killed").exists():
        time.sleep(0.02)
    return run(experiment)


store.run = noting
"""
OTHER_VERSIONS = """
from nmpcrl.study import provenance

provenance.LIBRARIES = provenance.LIBRARIES[1:]
"""
pytestmark = pytest.mark.usefixtures("runs")


@pytest.fixture
def dask(tmp_path) -> Iterator[Callable[..., subprocess.Popen]]:
    """Start a part of Dask, which ends with the test."""
    started = []

    def start(*arguments: str) -> subprocess.Popen:
        command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
        environment = os.environ | {"NMPCRL_RUNS": str(tmp_path / "elsewhere")}
        with (tmp_path / f"{len(started)}.log").open("w") as log:
            started.append(subprocess.Popen(command, env=environment, stdout=log, stderr=log))
        return started[-1]

    yield start
    for process in reversed(started):
        process.kill()
        process.wait()


@pytest.fixture
def address(dask, tmp_path) -> str:
    """The address of a scheduler without workers."""
    file = tmp_path / "scheduler.json"
    dask("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
    wait_until(file.exists)
    return json.loads(file.read_text())["address"]


@pytest.fixture
def worker(dask, address, tmp_path) -> Callable[[str], subprocess.Popen]:
    """Start a worker that first executes a text."""

    def start(text: str) -> subprocess.Popen:
        preload = tmp_path / "preload.py"
        preload.write_text(text)
        options = ("--nthreads", "1", "--no-nanny", "--preload", str(preload))
        return dask("worker", address, *options)

    return start


def wait_until(holds: Callable[[], object], seconds: float = 240.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "this was waited for in vain"
        time.sleep(0.02)


@pytest.mark.slow
def test_a_killed_worker_loses_no_run_and_no_bit(address, worker, tmp_path):
    pair = [worker(NOTING.format(folder=str(tmp_path))) for _ in range(2)]

    def began() -> list[Path]:
        return [*tmp_path.glob("began-*")]

    def kill_one_at_work() -> None:
        wait_until(lambda: len(began()) == 4 and sum(map(SUMMARIES.is_stored, SIX)) == 2)
        os.kill(pair[0].pid, signal.SIGKILL)
        (tmp_path / "killed").touch()

    killer = threading.Thread(target=kill_one_at_work)
    killer.start()
    with cluster.executor(address, 240.0) as executor:
        found = fetch_summaries(SIX, executor=executor, progress=False)
    killer.join()
    assert len(began()) == 7  # the worker's run is begun again, and no other
    for experiment in SIX:
        assert_same_numbers(found[experiment], summarise(run(experiment)))
        assert SUMMARIES.is_stored(experiment)
    assert not [*(tmp_path / "elsewhere").rglob("*.npz")]


def refused(address: str, patience: float, sentence: str) -> None:
    with pytest.raises(Refusal, match=sentence), cluster.executor(address, patience):
        pass


@pytest.mark.slow
def test_no_worker_and_one_with_other_versions_are_refused(address, worker):
    refused(address, 0.1, "has no worker")
    worker(OTHER_VERSIONS)
    refused(address, 240.0, "has other code or other versions of libraries")


@pytest.mark.parametrize("nobody", ["", "foo", "tcp://nowhere:1", "127.0.0.1:9", "x://y:1", "1,1"])
def test_where_no_scheduler_answers_nobody_is_waited_for(nobody):
    refused(nobody, 1.0, f"no scheduler answers at '{nobody}'")


def test_without_dask_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    refused("127.0.0.1:8786", 1.0, r"pip install 'nmpcrl\[cluster\]'")
