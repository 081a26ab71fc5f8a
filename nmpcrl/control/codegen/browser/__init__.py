"""The solver as one WebAssembly module, for a browser or any other engine: `from_texts`.

The very functions that train every run are compiled, with what numba brings and nothing more:

1. `ir`: numba writes the exported functions as LLVM IR, not optimised: that would be for this
   machine;
2. `emit`: llvmlite links `runtime.ll` to it, optimises it for wasm32, and writes an object file;
3. `link`: the object becomes a module with a memory of its own, which asks its host for some of
   `FUNCTIONS` and nothing else.

A module is built once and kept with the machine code.
"""

import gzip
import json
import os
import subprocess
import sys
import zlib
from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

from nmpcrl.control.codegen import folder, jit

UNASSUMING = {  # so that the IR fits any machine with 64-bit floats
    "NUMBA_OPT": "0",
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_LOOP_VECTORIZE": "0",
    "NUMBA_SLP_VECTORIZE": "0",
    "NUMBA_DISABLE_INTEL_SVML": "1",
    "NUMBA_DISABLE_JIT": "0",
}


def from_texts(texts: Mapping[str, str]) -> bytes:
    """The module that exports every function in the `EXPORTS` of the modules with these texts.

    Raises:
        RuntimeError: numba cannot compile them, or they call what a browser does not have.
    """
    own = [path.read_text("utf-8") for path in sorted(Path(__file__).parent.glob("*.*"))]
    name = jit.key("browser", texts, own, version("llvmlite"))
    return folder.use(f"{name}.wasm.gz", lambda place: _read_or_build(place, texts))


def _read_or_build(place: Path, texts: Mapping[str, str]) -> bytes:
    """The module in a file, built if the file is missing or damaged."""
    try:
        return gzip.decompress(place.read_bytes())
    except (FileNotFoundError, gzip.BadGzipFile, EOFError, zlib.error):
        module = _build(texts)
    with suppress(OSError):  # the next process makes it once more
        place.write_bytes(gzip.compress(module))
    return module


def _build(texts: Mapping[str, str]) -> bytes:
    """The module, built by a process of its own: numba's import reads `UNASSUMING`."""
    done = subprocess.run(
        [sys.executable, "-m", __name__],
        input=json.dumps(dict(texts)).encode(),
        env=os.environ | UNASSUMING,
        capture_output=True,
        check=False,
    )
    if done.returncode:
        reason = done.stderr.decode().strip() or "it says nothing"
        for kind in ("numba.core.errors.", f"{__name__}.link."):
            reason = reason.rpartition(kind)[2]
        raise RuntimeError(f"numba cannot compile these functions for a browser: {reason[-1000:]}")
    return done.stdout
