"""Live figures on the pages: what each displays whole becomes files that the pages share.

A figure's cell displays its scripts and its style inline, each as `report.live.frame` has it, so
that it also works in a notebook. A page links to one copy of each in _static/live; most of these
are in the source tree, and the compiled module is written there.
"""

import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

INLINE = re.compile(
    r'<(?P<kind>script|style) data-file="(?P<name>[\w.]+)">\n(?P<text>.*?)\n</(?P=kind)>',
    flags=re.S,
)
STATIC = "_static/live"  # on the site
ASKS = 'data-figure="runs"'  # this figure loads runs that its page was not given
LINKS = {"script": '<script src="{}"></script>', "style": '<link rel="stylesheet" href="{}">'}


def share(notebook: Any, page: Path, folder: Path) -> None:
    """Replace what a notebook's outputs hold inline, as `linked` does; the notebook is executed."""
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            if "text/html" in output.get("data", {}):
                output.data["text/html"] = linked(output.data["text/html"], page, folder)


def linked(html: str, page: Path, folder: Path) -> str:
    """HTML in which what was inline is a link from its page to a file.

    Args:
        html: what a cell displayed.
        page: the path of its page, from the root of the site.
        folder: of the files; they are copied to `STATIC`.

    Raises:
        ValueError: a file of this name is there and is another one.
    """
    place = os.path.relpath(STATIC, page.parent)

    def shared(found: re.Match[str]) -> str:
        path = folder / found["name"]
        if path.exists() and path.read_text("utf-8").strip() != found["text"]:
            raise ValueError(f"a live figure has another {path.name} than the one that pages share")
        path.write_text(found["text"], "utf-8")
        return LINKS[found["kind"]].format(f"{place}/{path.name}")

    return INLINE.sub(shared, html)


def add_runs(notebooks: Iterable[Any], folder: Path) -> None:
    """Write the files with all published runs if one of the notebooks has a figure that asks."""
    if any(ASKS in html for notebook in notebooks for html in shown(notebook)):
        from nmpcrl.report.live import published_runs  # with pandas and scipy, which take seconds

        for name, text in published_runs.scripts().items():
            (folder / name).write_text(text, "utf-8")


def shown(notebook: Any) -> list[str]:
    """The HTML of a notebook's outputs."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return [html for output in outputs if (html := output.get("data", {}).get("text/html"))]
