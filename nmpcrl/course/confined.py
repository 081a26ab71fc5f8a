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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

SETTLE = 0.1  # between two looks at the process [s]
FATAL = {"cpu": signal.SIGXCPU, "file": signal.SIGXFSZ}

Plan = list[tuple[str, str]]  # name and code of each cell


@dataclass(frozen=True)
class Limits:
    """What a notebook may take."""

    seconds: int = 120
    megabytes: int = 2000


@dataclass(frozen=True)
class Sat:
    """What became of a notebook."""

    ends: dict[str, dict[str, Any]]  # how each cell ended that did, by name
    stopped: str | None = None  # the cell that did not end, if there is one
    why: str = ""  # it did not


def run(plan: Plan, data: Path | None, limits: Limits) -> Sat:
    """Execute cells in a fresh process, in a temporary folder with a copy of the data."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        place = Path(name)
        work = place / "work"
        work.mkdir()
        if data is not None:
            shutil.copytree(data, work / "data")
        (place / "plan.json").write_text(json.dumps(plan))
        files = [str(place / "plan.json"), str(place / "log")]
        numbers = [str(limits.megabytes), str(limits.seconds)]
        why = _ended(
            [sys.executable, "-m", "nmpcrl.course.sitting", *files, *numbers], work, limits
        )
        return _read(place / "log", why)


def _ended(command: list[str], work: Path, limits: Limits) -> str:
    """Wait for a process, end it and its own at a limit, and say how it ended."""
    own = {"MPLBACKEND": "Agg", "IPYTHONDIR": str(work.parent), "TMPDIR": str(work)}
    child = subprocess.Popen(
        command,
        cwd=work,
        env=os.environ | own,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    until = time.monotonic() + limits.seconds
    why = ""
    try:
        while child.poll() is None and not why:
            if time.monotonic() > until:
                why = f"it took longer than {limits.seconds} s"
            elif _memory(child.pid) > limits.megabytes * 1_000_000:
                why = f"it took more than {limits.megabytes} MB of memory"
            time.sleep(SETTLE)
    finally:
        _end(child)
    if why or not child.returncode:
        return why or "it ended the process"
    if child.returncode == -FATAL["cpu"]:
        return f"it took longer than {limits.seconds} s"
    if child.returncode == -FATAL["file"]:
        return "it wrote too large a file"
    return f"it ended the process, with code {child.returncode}"


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


def _end(child: "subprocess.Popen[bytes]") -> None:
    """End a process, its group, and those that left the group."""
    for one in _family(child.pid)[1:]:
        with contextlib.suppress(psutil.Error):
            one.kill()
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def _read(log: Path, why: str) -> Sat:
    """How the cells ended, and which one did not."""
    ends: dict[str, dict[str, Any]] = {}
    begun: str | None = None
    for line in log.read_text().splitlines() if log.exists() else []:
        entry = json.loads(line)
        begun = None if "right" in entry else entry["name"]
        if "right" in entry:
            ends[entry["name"]] = entry
    return Sat(ends, begun, why)
