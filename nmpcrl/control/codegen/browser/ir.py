"""numba's compiler up to the LLVM IR: not optimised, not made machine code, not to be called.

Machine code took most of the time, and nobody would call it.
"""

# mypy: allow-untyped-calls

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from llvmlite import binding as llvm
from numba.core import codegen, cpu
from numba.core.registry import cpu_target

from nmpcrl.control.codegen import folder

PACKAGE = "in_browser"
TYPES = {"float64": "double", "int32": "i32"}  # of results, as LLVM calls them


class Function(NamedTuple):
    """A function that the module exports."""

    name: str
    symbol: str  #: in the IR
    result: str  #: its type


def describe(texts: Mapping[str, str]) -> tuple[list[Function], str]:
    """Every function in the `EXPORTS` of the modules, and the LLVM IR of all that they call."""
    cpu_target._toplevel_target_context = DescribingContext(cpu_target.typing_context, "cpu")
    exporting = [module for module, text in texts.items() if "\nEXPORTS = " in text]
    init = "\n".join(f"from . import {module}" for module in exporting)
    uncached = {module: text.replace(", cache=True", "") for module, text in texts.items()}
    with tempfile.TemporaryDirectory() as parent:
        place = Path(parent) / PACKAGE
        folder.write(place, uncached | {"__init__": init})
        package = folder.import_package(place)
    functions, whole = [], llvm.parse_assembly("")
    for exported in (one for module in exporting for one in getattr(package, module).EXPORTS):
        (result,) = exported.overloads.values()
        kind = TYPES[str(result.signature.return_type)]
        functions.append(Function(exported.__name__, result.fndesc.llvm_func_name, kind))
        whole.link_in(llvm.parse_bitcode(result.library.emit_bitcode()))
    return functions, str(whole)


class Library(codegen.AOTCodeLibrary):
    """The LLVM IR of a function and of all that it calls."""

    def get_pointer_to_function(self, name: str) -> int:
        """Zero, as numba's own gives for a function that is not here."""
        self._ensure_finalized()
        return 0

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """Nothing: `emit` optimises all functions together, for the host that runs them."""


class Codegen(codegen.AOTCPUCodegen):
    """Makes such libraries."""

    _library_class = Library

    def set_env(self, env_name: str, env: Any) -> None:
        """Nothing: only calls from Python need a function's environment."""


class DescribingContext(cpu.CPUContext):
    """Compiles by making such libraries, without wrappers for Python and C."""

    def init(self) -> None:
        super().init()
        self._describing = Codegen(PACKAGE, "generic")

    def codegen(self) -> Codegen:
        return self._describing

    def create_cpython_wrapper(self, *_: Any, **__: Any) -> None: ...

    def create_cfunc_wrapper(self, *_: Any, **__: Any) -> None: ...
