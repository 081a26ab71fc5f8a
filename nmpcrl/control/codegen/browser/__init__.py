"""The solver as one WebAssembly module, for a browser or any other engine: `module`.

The very functions that train every run are compiled, with what numba brings and nothing more:

1. `ir`: numba writes the exported functions down as LLVM IR, in a process of its own, without any
   optimisation, which would be for this machine;
2. `emit`: llvmlite links `runtime.ll` to it, optimises it for wasm32, and writes an object file;
3. `link`: the object becomes a module with a memory of its own. It asks its host for what
   it needs of `FUNCTIONS`, and for nothing else.

The same texts and versions give the same bytes, so what was made once is kept as machine code is.
"""

from nmpcrl.control.codegen.browser.build import PAGES, from_texts
from nmpcrl.control.codegen.browser.link import FUNCTIONS

__all__ = ["FUNCTIONS", "PAGES", "from_texts"]
