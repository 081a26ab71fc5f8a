"""Workers end with the process that started them, however it ends."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

pytestmark = pytest.mark.slow

JOBS = """
import ctypes
import os
import subprocess
import time
from functools import partial
from pathlib import Path


def job(folder, name, then):
    (Path(folder) / f"began-{name}-{os.getpid()}").touch()
    then()
    return name


def nothing():
    pass


def wait_aside():
    time.sleep(600)


def wait_alone():
    ctypes.PyDLL(None).sleep(600)  # no other thread of this process gets its turn


def nested():
    from nmpcrl.study.storage.executor import execute

    jobs = {"deep": partial(job, os.environ["FOLDER"], "deep", wait_aside)}
    execute(jobs, lambda *_: "", workers=1, progress=False)
"""
PROGRAM = """
import os, sys
from functools import partial
from pathlib import Path

import jobs
from nmpcrl.study.storage.executor import execute

folder = Path(os.environ["FOLDER"])


def keep(name, result):
    (folder / f"kept-{name}").touch()
    return ""


wanted = dict(pair.split("=") for pair in sys.argv[1:])
left = {n: t for n, t in wanted.items() if not (folder / f"kept-{n}").exists()}
work = {n: partial(jobs.job, str(folder), n, getattr(jobs, t)) for n, t in left.items()}
execute(work, keep, workers=2, progress=False)
"""


class Program:
    """A study of stand-in jobs in a session of its own, by which all its processes are known."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "jobs.py").write_text(JOBS)
        self.sessions: list[subprocess.Popen] = []

    def start(self, **jobs: str) -> subprocess.Popen:
        pairs = [f"{name}={then}" for name, then in jobs.items()]
        paths = [str(self.folder), str(Path.cwd())]
        self.sessions.append(
            subprocess.Popen(
                [sys.executable, "-c", PROGRAM, *pairs],
                env=os.environ | {"PYTHONPATH": os.pathsep.join(paths), "FOLDER": str(self.folder)},
                start_new_session=True,
            )
        )
        return self.sessions[-1]

    def alive(self) -> list[psutil.Process]:
        """All processes of the latest session that have not ended."""
        return [one for one in psutil.process_iter() if self._is_alive(one)]

    def _is_alive(self, process: psutil.Process) -> bool:
        try:
            ended = process.status() == psutil.STATUS_ZOMBIE
            return not ended and os.getsid(process.pid) == self.sessions[-1].pid
        except (psutil.NoSuchProcess, ProcessLookupError):
            return False

    def began(self, name: str) -> int:
        return len(list(self.folder.glob(f"began-{name}-*")))

    def kept(self) -> set[str]:
        return {path.name.removeprefix("kept-") for path in self.folder.glob("kept-*")}


@pytest.fixture
def program(tmp_path) -> Iterator[Program]:
    made = Program(tmp_path)
    yield made
    if made.sessions:
        for process in made.alive():
            process.kill()
        made.sessions[-1].wait()


def wait_until(holds, seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "this was waited for in vain"
        time.sleep(0.05)


@pytest.mark.parametrize("work", ["wait_aside", "wait_alone"])
def test_workers_end_with_a_parent_that_is_killed_busy_and_idle_ones(program, work):
    parent = program.start(busy=work, idle="nothing")
    wait_until(lambda: program.began("busy") and "idle" in program.kept())
    assert len(program.alive()) >= 3  # with what multiprocessing starts to clean up after them
    parent.kill()
    parent.wait()
    wait_until(lambda: not program.alive())


def test_the_workers_of_a_worker_end_with_its_parent(program):
    parent = program.start(outer="nested")
    wait_until(lambda: program.began("deep"))
    parent.kill()
    parent.wait()
    wait_until(lambda: not program.alive())


def test_what_was_kept_before_the_parent_was_killed_is_not_done_again(program):
    parent = program.start(one="nothing", two="nothing", three="wait_aside", four="wait_aside")
    wait_until(lambda: program.began("three") and program.began("four"))
    wait_until(lambda: program.kept() == {"one", "two"})
    parent.kill()
    parent.wait()
    wait_until(lambda: not program.alive())
    again = program.start(one="nothing", two="nothing", three="nothing", four="nothing")
    assert again.wait() == 0
    assert program.kept() == {"one", "two", "three", "four"}
    assert [program.began(name) for name in ("one", "two", "three", "four")] == [1, 1, 2, 2]
    wait_until(lambda: not program.alive())


def test_a_worker_that_is_killed_is_replaced_and_its_parent_goes_on(program, tmp_path):
    parent = program.start(one="nothing", two="wait_aside")
    wait_until(lambda: program.began("two"))
    for again in (1, 2):
        latest = max(tmp_path.glob("began-two-*"), key=lambda path: path.stat().st_mtime_ns)
        os.kill(int(latest.name.rpartition("-")[2]), signal.SIGKILL)
        wait_until(lambda again=again: program.began("two") == again + 1)
    assert parent.poll() is None
