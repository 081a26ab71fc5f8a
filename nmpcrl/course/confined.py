"""A process of its own for a notebook, in a folder of its own, that is ended when it must be."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from math import ceil
from pathlib import Path
from typing import Any, BinaryIO

import psutil

from nmpcrl.course.submissions import Chapter, Step

SETTLE = 0.1  # between two looks at the process [s]
NO_MEMORY = 77  # the code with which a process ends where a student's cell takes too much

End = dict[str, Any]  # of a cell: its `error`, if it is `right`, and the names it has `rebound`


@dataclass(frozen=True)
class Limits:
    """What a notebook may take."""

    seconds: int = 600  # in all
    cell: int = 60  # seconds of one cell of an exercise, or of one that was added
    megabytes: int = 2000


@dataclass(frozen=True)
class Sat:
    """What became of a notebook."""

    ends: dict[str, End]  # how each cell ended that did, by name
    why: str = ""  # others did not


def run(
    chapter: Chapter,
    steps: list[Step],
    limits: Limits,
    until: float,
    *,
    restored: bool = False,
    kept: Path | None = None,
) -> Sat:
    """Execute cells in a fresh process, in a temporary folder with a copy of the chapter's data.

    Args:
        chapter: to which they belong.
        steps: the cells.
        limits: of the notebook.
        until: when it has had its time, as `time.monotonic` counts it.
        restored: after each exercise the names of the chapter have their meaning again.
        kept: a new folder for the data as the cells leave them; nowhere if absent.
    """
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name,
        tempfile.TemporaryFile() as log,
    ):
        work = Path(name) / "work"
        work.mkdir()
        if chapter.data is not None:
            shutil.copytree(chapter.data, work / "data", symlinks=True)
        asked = sorted(chapter.asked)
        plan = {"steps": list(map(asdict, steps)), "asked": asked, "restored": restored}
        (work.parent / "plan.json").write_text(json.dumps(plan), "utf-8")
        seconds = max(1, ceil(until - time.monotonic()))
        words = [work.parent / "plan.json", log.fileno(), limits.megabytes, seconds, limits.cell]
        why = _ended(list(map(str, words)), log.fileno(), work, limits, until)
        if kept and (work / "data").is_dir():
            shutil.copytree(work / "data", kept, symlinks=True)
        return Sat(_ends(log), why)


def _ends(log: BinaryIO) -> dict[str, End]:
    """How the cells ended that did, up to a line that is none of ours."""
    ends: dict[str, End] = {}
    log.seek(0)
    with contextlib.suppress(ValueError, KeyError, TypeError):
        for line in log:
            end = json.loads(line)
            ends[end["name"]] = {key: end[key] for key in ("error", "right", "rebound")}
    return ends


def _ended(words: list[str], log: int, work: Path, limits: Limits, until: float) -> str:
    """Wait for a process, end it and its own at a limit, and say why it ended before the end."""
    own = {"MPLBACKEND": "Agg", "NMPCRL_STRICT": "1"}
    own |= {"IPYTHONDIR": str(work.parent), "TMPDIR": str(work)}
    child = subprocess.Popen(
        [sys.executable, "-m", "nmpcrl.course.sitting", *words],
        pass_fds=[log],
        cwd=work,
        env=os.environ | own,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    said = _said(limits)
    why = ""
    try:
        while child.poll() is None and not why:
            if time.monotonic() > until:
                why = said[-signal.SIGXCPU]
            elif _memory(child.pid) > limits.megabytes * 1_000_000:
                why = said[NO_MEMORY]
            time.sleep(SETTLE)
    finally:
        _end(child, work.parent)
    code = child.returncode
    return why or said.get(code, f"it ended the process, with code {code}")


def _said(limits: Limits) -> dict[int, str]:
    """What codes mean with which a process ends."""
    return {
        0: "it ended the process",
        NO_MEMORY: f"it took more than {limits.megabytes} MB of memory",
        -signal.SIGALRM: f"a cell took longer than {limits.cell} s",
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


def _end(child: "subprocess.Popen[bytes]", home: Path) -> None:
    """End a process, its group, and those that left the group."""
    for one in [*_family(child.pid)[1:], *_strays(home)]:
        with contextlib.suppress(psutil.Error):
            one.kill()
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()
