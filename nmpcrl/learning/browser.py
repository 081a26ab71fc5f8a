"""Everything that learns in a browser, as one WebAssembly module."""

from importlib.resources import files

from nmpcrl.control import Plant, Problem, Task, browser
from nmpcrl.control.codegen.browser import from_texts

OWN = ("updates", "loop", "rules", "dense", "network_entries")


def module(of: Plant | Problem, task: Task | None = None) -> bytes:
    """`control.browser.module` with what `rules` and `network_entries` describe.

    Raises:
        CannotCompile, RuntimeError, CannotLink: as there.
    """
    here = files(__package__)
    own = {name: here.joinpath(f"{name}.py").read_text("utf-8") for name in OWN}
    return from_texts(browser.texts(of, task) | own)
