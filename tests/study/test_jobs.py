"""Jobs on processes and executors: what is yielded, what fails, and that no process stays."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import psutil
import pytest

from nmpcrl.study.jobs import ONE_THREAD, Failed, parallel, usable_workers
from nmpcrl.study.parameters import ParameterError

PROGRAM = """
import ctypes, os, sys, time
from pathlib import Path
from nmpcrl.study.jobs import parallel

FOLDER = Path(os.environ["FOLDER"])


def job(pair):
    name, what = pair
    (FOLDER / f"began-{name}-{os.getpid()}").touch()
    if what == "sleeps":
        time.sleep(600)
    if what == "blocks":
        ctypes.PyDLL(None).sleep(2)  # no other thread of this process has a turn
    if what == "nests":
        list(parallel(job, [("deep", "sleeps")], 1))
    return os.environ["OMP_NUM_THREADS"]


pairs = [argument.split("=") for argument in sys.argv[1:]]
for (name, _), threads in parallel(job, pairs, 2):
    (FOLDER / f"ended-{name}-{threads}-{os.environ.get('OMP_NUM_THREADS')}").touch()
"""


class Program:
    """A script without a guard of its main module, in a session of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.process = folder, None

    def start(self, *options: str, **jobs: str) -> subprocess.Popen:
        environment = {k: v for k, v in os.environ.items() if k not in ONE_THREAD}
        arguments = [f"{name}={what}" for name, what in jobs.items()]
        self.process = subprocess.Popen(
            [sys.executable, *options, "-c", PROGRAM, *arguments],
            env=environment | {"PYTHONPATH": str(Path.cwd()), "FOLDER": str(self.folder)},
            start_new_session=True,
            preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),  # `&` ignores it
        )
        return self.process

    def alive(self) -> list[psutil.Process]:
        return [one for one in psutil.process_iter() if self._is_alive(one)]

    def _is_alive(self, process: psutil.Process) -> bool:
        try:
            ended = process.status() == psutil.STATUS_ZOMBIE
            return not ended and os.getsid(process.pid) == self.process.pid
        except (psutil.NoSuchProcess, ProcessLookupError):
            return False

    def began(self, name: str) -> list[int]:
        """Processes that began a job, the latest last."""
        paths = self.folder.glob(f"began-{name}-*")
        ordered = sorted(paths, key=lambda path: path.stat().st_mtime_ns)
        return [int(path.name.rpartition("-")[2]) for path in ordered]

    def ended(self) -> set[str]:
        return {path.name.split("-")[1] for path in self.folder.glob("ended-*")}


@pytest.fixture
def program(tmp_path) -> Iterator[Program]:
    made = Program(tmp_path)
    yield made
    for process in made.alive():
        process.kill()
    made.process.wait()


def wait_until(holds: Callable[[], object], seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "this was waited for in vain"
        time.sleep(0.05)


def misbehave(what: str) -> object:
    if what == "raise":
        raise ValueError("no")
    if what == "exit":
        sys.exit("now")
    if what == "recurse":
        return misbehave(what)
    return (lambda: None) if what == "return a function" else what.upper()


@pytest.mark.parametrize(
    ("bad", "error"),
    [
        ("raise", "ValueError: no"),
        ("exit", "SystemExit: now"),
        ("recurse", "RecursionError: maximum recursion depth"),
        ("return a function", "lambda"),
    ],
)
def test_a_failed_job_stops_no_other_one_and_is_raised_at_the_end(bad, error):
    yielded = []
    with ThreadPoolExecutor(1) as threads, pytest.raises(Failed, match=error) as raised:
        yielded.extend(parallel(misbehave, ["a", bad, "b"], executor=threads))
    assert sorted(yielded) == [("a", "A"), ("b", "B")]
    assert str(raised.value).startswith(f"1 of 3 failed, {bad} because of ")
    (failure,) = raised.value.failures
    assert failure.item == bad
    assert error in failure.traceback


def test_an_item_is_looked_at_when_its_turn_comes_and_may_be_skipped(trains_here):
    drawn = []

    def ready(item: int) -> bool:
        drawn.append(item)
        return item % 3 > 0

    for count, (item, made) in enumerate(parallel(abs, range(9), 1, ready=ready), 1):
        assert item == made > 0
        assert len(drawn) <= count * 3 // 2 + 2
    assert (drawn, count) == ([*range(9)], 6)


@pytest.mark.parametrize("workers", [0, -1, 1.5, True, "2"])
def test_a_number_of_workers_is_refused_by_its_value(workers):
    with pytest.raises(ParameterError, match=f"workers = {workers!r} must be a whole number"):
        list(parallel(abs, [1], workers))


def test_there_are_no_more_workers_than_cores_and_memory_for(monkeypatch, tmp_path):
    assert 1 <= usable_workers() <= (os.cpu_count() or 1)
    (tmp_path / "memory.max").write_text("500000000\n")
    monkeypatch.setattr("nmpcrl.study.jobs.LIMIT", tmp_path / "memory.max")
    assert usable_workers() == 1


@pytest.mark.slow
def test_a_worker_has_one_thread_and_a_script_needs_no_guard(program):
    assert program.start(one="ends", two="ends", three="ends").wait() == 0
    assert sorted(path.name for path in program.folder.glob("ended-*")) == [
        "ended-one-1-None",
        "ended-three-1-None",
        "ended-two-1-None",
    ]
    wait_until(lambda: not program.alive(), 5)


@pytest.mark.slow
@pytest.mark.parametrize("sent", [signal.SIGKILL, signal.SIGINT])
@pytest.mark.parametrize("job", ["sleeps", "blocks", "nests"])
def test_no_process_outlives_the_parent(program, job, sent):
    parent = program.start(idle="ends", busy=job)
    wait_until(lambda: program.began("deep" if job == "nests" else "busy"))
    wait_until(lambda: "idle" in program.ended())
    if sent == signal.SIGINT:
        os.killpg(parent.pid, sent)  # as a terminal does
    else:
        parent.kill()
    assert parent.wait(120) != 0
    wait_until(lambda: not program.alive())


@pytest.mark.slow
def test_a_job_whose_process_is_killed_is_begun_again_and_then_fails_alone(program):
    parent = program.start(one="ends", two="sleeps", three="ends")
    for count in range(3):
        wait_until(lambda count=count: len(program.began("two")) == count + 1)
        os.kill(program.began("two")[-1], signal.SIGKILL)
    assert parent.wait() == 1
    assert program.ended() == {"one", "three"}
