"""A study on a Dask scheduler and two workers of this machine, which share no folder with it."""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator

import pytest
from builders import assert_same_numbers

from nmpcrl.analysis.summaries import SUMMARIES, fetch_summaries
from nmpcrl.analysis.summary import summarise
from nmpcrl.study import run, sweep

distributed = pytest.importorskip("distributed", reason="needs the extra nmpcrl[cluster]")

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
pytestmark = pytest.mark.usefixtures("runs")


@pytest.fixture
def dask(tmp_path) -> Iterator[Callable[..., str]]:
    """Start a scheduler, and workers that first execute a text; its address is returned."""
    started = []

    def start(workers: int, text: str = "") -> str:
        preload = tmp_path / "preload.py"
        preload.write_text(text)
        how = {"threads_per_worker": 1, "dashboard_address": None, "preload": str(preload)}
        elsewhere = {"NMPCRL_RUNS": str(tmp_path / "elsewhere")}
        started.append(distributed.LocalCluster(n_workers=workers, env=elsewhere, **how))
        return started[-1].scheduler_address

    yield start
    for one in started:
        one.close()


@pytest.mark.slow
def test_a_killed_worker_loses_no_run_and_no_bit(dask, tmp_path):
    address = dask(2, NOTING.format(folder=str(tmp_path)))

    def began() -> list[int]:
        """The processes that began a run, the latest last."""
        paths = sorted(tmp_path.glob("began-*"), key=lambda path: path.stat().st_mtime_ns)
        return [int(path.name.rpartition("-")[2]) for path in paths]

    def kill_one_at_work() -> None:
        end = time.monotonic() + 240
        while len(began()) < 4 or sum(SUMMARIES.path_of(one).exists() for one in SIX) < 2:
            assert time.monotonic() < end, "this was waited for in vain"
            time.sleep(0.02)
        os.kill(began()[-1], signal.SIGKILL)
        (tmp_path / "killed").touch()

    killer = threading.Thread(target=kill_one_at_work)
    killer.start()
    with distributed.Client(address) as client:
        executor = client.get_executor(pure=False)
        found = fetch_summaries(SIX, executor=executor, progress=False)
    killer.join()
    assert len(began()) == 7  # the worker's run is begun again, and no other
    for experiment in SIX:
        assert_same_numbers(found[experiment], summarise(run(experiment)))
        assert SUMMARIES.read(experiment)
    assert not [*(tmp_path / "elsewhere").rglob("*.npz")]
