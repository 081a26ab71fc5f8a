"""Texts to a module, made once and then kept as machine code is."""

import hashlib
import sys
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

from nmpcrl.control.codegen import folder
from nmpcrl.control.codegen.browser import emit, ir, link

PAGES = 64  # of 64 KiB; a solve with 40 planned inputs among 16 obstacles takes three of them
SEAL = 64  # bytes of `_seal`


def from_texts(texts: Mapping[str, str], pages: int = PAGES) -> bytes:
    """The module that exports every function in the `EXPORTS` of the modules with these texts.

    Raises:
        RuntimeError: numba cannot compile them.
        CannotLink: they call what a browser does not have.
    """
    depends = [sorted(texts.items()), _own(), version("numba"), version("llvmlite"), pages]
    called = f"browser_{hashlib.sha256(repr(depends).encode()).hexdigest()[:16]}.wasm"
    kept = _kept(called)
    if kept is not None:
        return kept
    package = ir.compiled(texts)
    exports = [function["name"] for function in package["functions"]]
    module = link.link(emit.emit(package), [*emit.RUNTIME, *exports], pages)
    with suppress(OSError):  # it is made, and the next process makes it once more
        _keep(module, folder.private(folder.chosen()) / called)
    return module


def _keep(module: bytes, place: Path) -> None:
    """Write it behind its hash, whole or not at all."""
    with tempfile.NamedTemporaryFile(dir=place.parent, prefix=".draft", delete=False) as draft:
        path = Path(draft.name)
    try:
        path.write_bytes(_seal(module) + module)
        path.replace(place)
    except OSError:
        path.unlink(missing_ok=True)
        raise


def _kept(called: str) -> bytes | None:
    """What was made before, if it is whole."""
    try:
        content = (folder.private(folder.chosen()) / called).read_bytes()
    except OSError:
        return None
    seal, module = content[:SEAL], content[SEAL:]
    return module if _seal(module) == seal else None


def _seal(module: bytes) -> bytes:
    """What stands before a kept module, so that damage is noticed."""
    return hashlib.sha256(module).hexdigest().encode()


def _own() -> list[str]:
    """The text of this package and the version of Python."""
    here = Path(__file__).parent
    return [sys.version, *(path.read_text("utf-8") for path in sorted(here.glob("*.*")))]
