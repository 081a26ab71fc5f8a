"""A package of modules by their texts to LLVM IR.

A process of its own, because numba reads what it may assume of a machine when it is imported: here
nothing, so that the IR fits any machine with 64-bit floats.
"""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from typing import Any

from nmpcrl.control.codegen import importing

UNASSUMING = {
    "NUMBA_OPT": "0",
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_LOOP_VECTORIZE": "0",
    "NUMBA_SLP_VECTORIZE": "0",
    "NUMBA_DISABLE_INTEL_SVML": "1",
    "NUMBA_DISABLE_JIT": "0",
}
PACKAGE = "in_browser"
TYPES = {"float64": "double", "int32": "i32"}  # of results, as LLVM calls them


def functions(texts: Mapping[str, str]) -> list[dict[str, str]]:
    """Every function in the `EXPORTS` of the modules: its name, symbol, result type and LLVM IR.

    Raises:
        RuntimeError: numba cannot compile them; with the end of what it says.
    """
    done = subprocess.run(
        [sys.executable, "-c", f"from {__name__} import main; main()"],
        input=json.dumps(dict(texts)),
        env=os.environ | UNASSUMING,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        said = done.stderr.strip() or "it says nothing"
        why = said.rpartition("numba.core.errors.")[2] if "numba.core.errors." in said else said
        raise RuntimeError(f"numba cannot compile these functions for a browser: {why[-1000:]}")
    found: list[dict[str, str]] = json.loads(done.stdout)
    return found


def _written(function: Any) -> dict[str, str]:
    """A compiled function of one signature."""
    (signature,) = function.signatures
    compiled = function.overloads[signature]
    return {
        "name": function.__name__,
        "symbol": compiled.fndesc.llvm_func_name,
        "result": TYPES[str(compiled.signature.return_type)],
        "ir": compiled.library.get_llvm_str(),
    }


def main() -> None:
    """Texts on standard input, functions on standard output, both as JSON."""
    texts = {
        module: text.replace(", cache=True", "") for module, text in json.load(sys.stdin).items()
    }
    exporting = [module for module, text in texts.items() if "\nEXPORTS = " in text]
    texts["__init__"] = "\n".join(f"from . import {module}" for module in exporting)
    package = importing.from_memory(PACKAGE, texts)
    modules = [getattr(package, module) for module in exporting]
    json.dump([_written(each) for module in modules for each in module.EXPORTS], sys.stdout)
