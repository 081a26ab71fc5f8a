"""How many processes this machine has room for: by its cores, and by its memory."""

import math
import os
from collections.abc import Iterator
from pathlib import Path

import psutil

from nmpcrl.study.storage.refusal import ParameterError

MEMORY = 0.45e9  # [bytes]; what a worker has at the end of a full run of RDES, resident
GROUP = Path("/proc/self/cgroup")  # where Linux says in which control group a process is
GROUPS = Path("/sys/fs/cgroup")


def check_workers(workers: int | None, *, sure: bool = False) -> int:
    """How many processes to start: as many as asked, or as there are cores and memory for.

    Args:
        workers: how many are asked for.
        sure: whether they are wanted even where there is no room for them.

    Raises:
        ParameterError: this is no number of processes, or there is no room for them.
    """
    cores, free = usable_cores(), free_memory()
    room = max(1, int(free / MEMORY))
    if workers is None:
        return min(cores, room)
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise ParameterError(f"workers = {workers!r} must be a whole number, 1 or more")
    if workers > cores and not sure:
        raise ParameterError(
            f"workers = {workers} must be at most {cores}, the number of usable cores: more would"
            " only slow each other down"
        )
    if workers > room and not sure:
        raise ParameterError(
            f"workers = {workers} must be at most {room}: each takes about {_size(MEMORY)} of"
            f" memory, and {_size(free)} are free"
        )
    return workers


def told(workers: int) -> str:
    """How much memory so many workers take, in a sentence."""
    each = f"{workers} workers, each with" if workers > 1 else "1 worker with"
    return f"{each} about {_size(MEMORY)} of memory; {_size(free_memory())} are free"


def usable_cores() -> int:
    """The cores that this process may use: by its affinity, and by the quota of its group."""
    affinity = getattr(os, "sched_getaffinity", None)  # on Linux
    cores = [len(affinity(0)) if affinity else os.cpu_count() or 1]
    for group in _groups():
        quota, *period = _words(group / "cpu.max")
        if quota != "max":
            cores.append(math.ceil(int(quota) / int(period[0])))
    return max(1, min(cores))


def free_memory() -> float:
    """The memory that this process may still take, on this machine and in its group [bytes]."""
    free = [float(psutil.virtual_memory().available)]
    for group in _groups():
        (limit,) = _words(group / "memory.max")
        if limit != "max":
            taken = dict(zip(*[iter(_words(group / "memory.stat"))] * 2, strict=False))
            free.append(float(limit) - float(taken.get("anon", 0)))  # the rest can be given back
    return max(0.0, min(free))


def _groups() -> Iterator[Path]:
    """The control group of this process, and those that it lies in, of Linux's second kind."""
    lines = GROUP.read_text().splitlines() if GROUP.exists() else []
    for name in [line.removeprefix("0::/") for line in lines if line.startswith("0::/")]:
        place = GROUPS / name
        yield place
        yield from (above for above in place.parents if above.is_relative_to(GROUPS))


def _words(file: Path) -> list[str]:
    """What a file of a control group says; the outermost group has none, and no limit."""
    try:
        return file.read_text().split() or ["max"]
    except OSError:
        return ["max"]


def _size(memory: float) -> str:
    return f"{memory / 1e9:.1f} GB" if memory >= 1e9 else f"{memory / 1e6:.0f} MB"
