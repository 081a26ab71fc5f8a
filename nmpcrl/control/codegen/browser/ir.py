"""A package of modules by their texts to LLVM IR.

A process of its own, because numba reads what it may assume of a machine when it is imported: here
nothing, so that the IR fits any machine with 64-bit floats. Nor does numba optimise it there and
make machine code of it, which took most of the time and which nobody would call.
"""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from typing import TypedDict

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


class Function(TypedDict):
    """One that the module exports."""

    name: str
    symbol: str  # in the IR
    result: str  # its type


class Package(TypedDict):
    """Functions, and the LLVM IR of these and of all that they call."""

    functions: list[Function]
    ir: str


def compiled(texts: Mapping[str, str]) -> Package:
    """Every function in the `EXPORTS` of the modules.

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
    package: Package = json.loads(done.stdout)
    return package


def main() -> None:
    """Texts on standard input, the package on standard output, both as JSON."""
    from llvmlite import binding as llvm

    from nmpcrl.control.codegen.browser import context

    context.install()
    texts = {
        module: text.replace(", cache=True", "") for module, text in json.load(sys.stdin).items()
    }
    exporting = [module for module, text in texts.items() if "\nEXPORTS = " in text]
    texts["__init__"] = "\n".join(f"from . import {module}" for module in exporting)
    package = importing.from_memory(PACKAGE, texts)
    functions, whole = [], llvm.parse_assembly("")
    for exported in (one for module in exporting for one in getattr(package, module).EXPORTS):
        (signature,) = exported.signatures
        result = exported.overloads[signature]
        described = Function(
            name=exported.__name__,
            symbol=result.fndesc.llvm_func_name,
            result=TYPES[str(result.signature.return_type)],
        )
        functions.append(described)
        whole.link_in(llvm.parse_bitcode(result.library.emit_bitcode()))
    json.dump(Package(functions=functions, ir=str(whole)), sys.stdout)
