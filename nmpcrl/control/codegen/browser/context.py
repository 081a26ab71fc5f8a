"""numba's compiler up to the LLVM IR: not optimised, not made machine code, not to be called."""

# mypy: allow-untyped-calls

from typing import Any

from numba.core import codegen, cpu
from numba.core.registry import cpu_target


class Library(codegen.AOTCodeLibrary):
    """What a function and all that it calls are in LLVM IR."""

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
        """Nothing: what a function finds in its environment is needed to call it from Python."""


class DescribingContext(cpu.CPUContext):
    """Compiles by making such libraries."""

    def init(self) -> None:
        super().init()
        self._describing = Codegen("in_browser", "generic")

    def codegen(self) -> Codegen:
        return self._describing

    def create_cpython_wrapper(self, *_: Any, **__: Any) -> None:
        """None: nothing is called from Python."""

    def create_cfunc_wrapper(self, *_: Any, **__: Any) -> None:
        """None: nothing is called from C."""


def install() -> None:
    """Let all that this process compiles from now on be described and no more."""
    cpu_target._toplevel_target_context = DescribingContext(cpu_target.typing_context, "cpu")
