"""A process for the cells of a notebook, in a folder of its own, that is ended when it must be.

It is no Jupyter kernel: the client of one cannot answer a call while a cell is executed, as checks
do whose functions an answer calls; and it has neither a limit of memory nor less to start.
"""

import contextlib
import json
import math
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil

from nmpcrl.course.cells import NO_MEMORY
from nmpcrl.course.peer import LONGEST, SIZE, Message, framed

SETTLE = 0.1  # between two looks at the process [s]


class Stopped(Exception):
    """The process did not come to the end of what it was asked; says why."""


@dataclass(frozen=True)
class Limits:
    """What a notebook may take."""

    seconds: int = 600  # in all
    cell: int = 60  # seconds of one cell of an exercise, or of one that was added
    megabytes: int = 2000


class Process:
    """A process that executes cells, as `cells` says, until it is ended."""

    def __init__(self, work: Path, limits: Limits, until: float, *, seconds: int) -> None:
        self.work = work
        self.until = until  # as `time.monotonic` counts it
        self._limits = limits
        self._looked = 0.0  # at its memory, when
        (hears, self._to), (self._from, says) = os.pipe(), os.pipe()
        os.set_blocking(self._to, False)
        words = map(str, (hears, says, limits.megabytes, seconds))
        own = {"MPLBACKEND": "Agg", "NMPCRL_STRICT": "1"}
        own |= {"IPYTHONDIR": str(work.parent), "TMPDIR": str(work), "NMPCRL_DATA": "data"}
        self._child = subprocess.Popen(
            [sys.executable, "-m", "nmpcrl.course.cells", *words],
            pass_fds=[hears, says],
            cwd=work,
            env=os.environ | own,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        os.close(hears)
        os.close(says)

    def ask(self, message: Message, *kinds: str, until: float = math.inf) -> Message:
        """Send a message, and wait for one of these kinds.

        Raises:
            Stopped: there is none, or not in time.
        """
        data = framed(message)
        while data:
            self._wait([], [self._to], until)
            try:
                data = data[os.write(self._to, data) :]
            except BrokenPipeError:
                raise Stopped(self._end_of_itself()) from None
        size = int.from_bytes(self._read(SIZE, until))
        if size > LONGEST:
            raise Stopped("it gave more than can be read")
        try:
            heard: Message = json.loads(self._read(size, until))
            if heard["kind"] in kinds:
                return heard
        except (ValueError, TypeError, KeyError, RecursionError):
            pass
        raise Stopped("it gave something else than it was asked")

    def _read(self, size: int, until: float) -> bytes:
        data = b""
        while len(data) < size:
            self._wait([self._from], [], until)
            new = os.read(self._from, size - len(data))
            if not new:
                raise Stopped(self._end_of_itself())
            data += new
        return data

    def _wait(self, readable: list[int], writable: list[int], until: float) -> None:
        """Wait until a pipe is ready, and watch the process meanwhile."""
        self._watch(until)
        while not any(select.select(readable, writable, [], SETTLE)):
            self._watch(until)

    def _watch(self, until: float) -> None:
        now, said = time.monotonic(), _said(self._limits)
        if now > self.until:
            raise Stopped(said[-signal.SIGXCPU])
        if now > until:
            raise Stopped(f"a cell took longer than {self._limits.cell} s")
        if now > self._looked + SETTLE:
            self._looked = now
            if _memory(self._child.pid) > self._limits.megabytes * 1_000_000:
                raise Stopped(said[NO_MEMORY])
            if self._child.poll() is not None:
                raise Stopped(self._end_of_itself())

    def _end_of_itself(self) -> str:
        """Why the process is at its end, or says no more."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._child.wait(10 * SETTLE)
        code = self._child.poll() or 0
        return _said(self._limits).get(code, f"it ended the process, with code {code}")

    def end(self) -> None:
        """End the process, its group, and those that left the group."""
        for one in [*_family(self._child.pid)[1:], *_strays(self.work.parent)]:
            with contextlib.suppress(psutil.Error):
                one.kill()
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._child.pid, signal.SIGKILL)
        self._child.wait()
        os.close(self._to)
        os.close(self._from)


@contextlib.contextmanager
def process(
    data: Path | None, limits: Limits, until: float, *, trusted: bool = False
) -> Iterator[Process]:
    """A fresh process in a temporary folder, with a copy of the data, that ends with the block.

    Args:
        data: a folder that the cells find as `data`.
        limits: of the notebook.
        until: when it has had its time, as `time.monotonic` counts it.
        trusted: it executes nothing that a student wrote, and may compute for many of them.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        work = Path(name) / "work"
        work.mkdir()
        if data is not None:
            shutil.copytree(data, work / "data", symlinks=True)
        left = max(1, math.ceil(until - time.monotonic()))
        made = Process(work, limits, until, seconds=0 if trusted else left)
        try:
            yield made
        finally:
            made.end()


def _said(limits: Limits) -> dict[int, str]:
    """What codes mean with which a process ends."""
    return {
        0: "it ended the process",
        NO_MEMORY: f"it took more than {limits.megabytes} MB of memory",
        -signal.SIGXCPU: f"the notebook took longer than {limits.seconds} s",
        -signal.SIGXFSZ: "it wrote too large a file",
    }


def _family(pid: int) -> list[psutil.Process]:
    """A process and those that it started, as far as they are still there."""
    try:
        process = psutil.Process(pid)
        return [process, *process.children(recursive=True)]
    except psutil.NoSuchProcess:
        return []


def _memory(pid: int) -> int:
    """Bytes of memory of a process and those that it started."""
    total = 0
    for one in _family(pid):
        with contextlib.suppress(psutil.Error):
            total += one.memory_info().rss
    return total


def _strays(home: Path) -> list[psutil.Process]:
    """Processes that began with the environment of a notebook, wherever they have gone since."""
    found = []
    for one in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if one.environ().get("IPYTHONDIR") == str(home):
                found.append(one)
    return found
