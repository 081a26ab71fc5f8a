"""This machine, and its properties that change the last digits of numbers."""

import os
import platform
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import NotRequired, TypedDict, cast

CPUINFO = Path("/proc/cpuinfo")
SETTINGS = (  # environment variables that choose other machine code
    *("NUMBA_DISABLE_JIT", "NUMBA_OPT", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"),
    *("OPENBLAS_CORETYPE", "ATEN_CPU_CAPABILITY", "MKL_CBWR", "GLIBC_TUNABLES"),
)


class Machine(TypedDict):
    """A machine as a page names it."""

    processor: str
    architecture: str
    cores: int | None
    system: str


class Fingerprint(Machine):
    """The properties that must be equal for the same bits, like code and versions."""

    library: str  # of C: sines and cosines
    abilities: str  # a hash of the processor's instruction sets, for which code is compiled
    settings: NotRequired[dict[str, str]]  # those of `SETTINGS` that are set


def machine() -> Machine:
    """This machine, for a page."""
    names = [line.partition(":")[2].strip() for line in _cpuinfo() if line.startswith("model name")]
    return {
        "processor": names[0] if names else platform.processor() or "unknown",
        "architecture": platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.system(),
    }


def fingerprint() -> Fingerprint:
    """This machine, for a comparison with the machines of stored and published runs."""
    lines = ("flags", "Features", "cpu family", "model\t")
    found = sorted({line for line in _cpuinfo() if line.startswith(lines)})
    abilities = sha256("\n".join(found).encode()).hexdigest()[:16]
    known = cast(
        Fingerprint,
        {**machine(), "library": " ".join(platform.libc_ver()), "abilities": abilities},
    )
    if settings := {name: os.environ[name] for name in SETTINGS if os.environ.get(name)}:
        known["settings"] = settings
    return known


@cache
def _cpuinfo() -> tuple[str, ...]:
    """The lines in which Linux describes the processor; none on other systems."""
    return tuple(CPUINFO.read_text().splitlines()) if CPUINFO.exists() else ()
