"""What is known of this machine: enough to tell whether the same code must give the same bits."""

import os
import platform
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import NotRequired, TypedDict, cast

import psutil

CPUINFO = Path("/proc/cpuinfo")
BOOT = Path("/proc/sys/kernel/random/boot_id")  # another after each start of the machine
NAMESPACE = Path("/proc/self/ns/pid")  # another in each container
SETTINGS = (  # environment variables by which the same code gives other last digits
    "NUMBA_DISABLE_JIT",
    "NUMBA_OPT",
    "NUMBA_CPU_NAME",
    "NUMBA_CPU_FEATURES",
    "NUMBA_LOOP_VECTORIZE",
    "NUMBA_SLP_VECTORIZE",
    "OPENBLAS_CORETYPE",
    "ATEN_CPU_CAPABILITY",
    "MKL_CBWR",
    "GLIBC_TUNABLES",
)
CONFIGURED = Path(".numba_config.yaml")  # in the working folder, where numba looks for it


class Machine(TypedDict):
    """What a reader has to know of it."""

    processor: str
    architecture: str
    cores: int | None
    system: str


class Fingerprint(Machine):
    """All of it on which last digits depend."""

    library: str  # of C
    abilities: str  # a hash of what its processor can do
    settings: NotRequired[dict[str, str]]  # what `SETTINGS` and numba's file say, if anything


def machine() -> Machine:
    """This one, in short."""
    return {
        "processor": _processor(),
        "architecture": platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.system(),
    }


def fingerprint() -> Fingerprint:
    """`machine`, with the abilities of its processor, its C library, and what `SETTINGS` say.

    Machine code is made for the first, and processors of one name may differ in them; sines and
    cosines come from the second.
    """
    settings = {name: os.environ[name] for name in SETTINGS if os.environ.get(name)}
    if CONFIGURED.is_file():
        settings[CONFIGURED.name] = sha256(CONFIGURED.read_bytes()).hexdigest()[:16]
    known = _fingerprint().copy()
    if settings:
        known["settings"] = settings
    return known


@cache
def _fingerprint() -> Fingerprint:
    kept = ("flags", "Features", "cpu family", "model\t")
    told = sorted({line for line in _cpuinfo() if line.startswith(kept)})
    abilities = sha256("\n".join(told).encode()).hexdigest()[:16]
    found = {**machine(), "library": " ".join(platform.libc_ver()), "abilities": abilities}
    return cast(Fingerprint, found)


@cache
def host() -> str:
    """The host or container, until its next start: within it, a process has one number."""
    told = [platform.node(), *map(_told_by, (BOOT, NAMESPACE))]
    return sha256("\n".join(told).encode()).hexdigest()[:8]


def is_running(process: int) -> bool:
    """Whether there is a process of this number on this `host`."""
    return bool(psutil.pid_exists(process))


def _told_by(path: Path) -> str:
    try:
        return str(path.readlink()) if path.is_symlink() else path.read_text()
    except OSError:
        return ""


def _processor() -> str:
    """The processor's name, where the system tells it."""
    names = [line.partition(":")[2] for line in _cpuinfo() if line.startswith("model name")]
    return names[0].strip() if names else platform.processor() or "unknown"


def _cpuinfo() -> list[str]:
    try:
        return CPUINFO.read_text().splitlines()
    except OSError:
        return []
