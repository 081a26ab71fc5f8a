"""This machine, and its properties that change the last digits of numbers."""

import os
import platform
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

CPUINFO = Path("/proc/cpuinfo")
SETTINGS = (  # environment variables that choose other machine code
    *("NUMBA_DISABLE_JIT", "NUMBA_OPT", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"),
    *("OPENBLAS_CORETYPE", "ATEN_CPU_CAPABILITY", "MKL_CBWR", "GLIBC_TUNABLES"),
)


def machine() -> dict[str, Any]:
    """Processor, architecture, cores and system of this machine, for a page."""
    names = [line.partition(":")[2].strip() for line in _cpuinfo() if line.startswith("model name")]
    return {
        "processor": names[0] if names else platform.processor() or "unknown",
        "architecture": platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.system(),
    }


def fingerprint() -> dict[str, Any]:
    """The properties of this machine on which the last bits of numbers depend.

    Beside `machine`: the library of C, for its sines; a hash of the processor's instruction sets,
    for which code is compiled; and the `SETTINGS` that are set, if any.
    """
    lines = ("flags", "Features", "cpu family", "model\t")
    found = sorted({line for line in _cpuinfo() if line.startswith(lines)})
    abilities = sha256("\n".join(found).encode()).hexdigest()[:16]
    known = machine() | {"library": " ".join(platform.libc_ver()), "abilities": abilities}
    settings = {name: os.environ[name] for name in SETTINGS if os.environ.get(name)}
    return known | ({"settings": settings} if settings else {})


@cache
def _cpuinfo() -> tuple[str, ...]:
    """The lines in which Linux describes the processor; none on other systems."""
    return tuple(CPUINFO.read_text().splitlines()) if CPUINFO.exists() else ()
