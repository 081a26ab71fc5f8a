"""A deck for each executed chapter, by nbconvert, that needs no network.

Cells tagged `slide` are shown: the goals, and a cell that begins with a heading, begin a slide, and
the others continue it. Cells tagged `notes` are for the speaker. reveal.js and MathJax are copied
from the packages sphinx-revealjs and sphinx-mathjax-offline. Arrows move, S opens the speaker's
window, and `?print-pdf` at the end of the address is for printing.
"""

import re
import shutil
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import nbformat
from traitlets.config import Config

from driver.project import ROOT, Failure
from nmpcrl.course.exercises import tags_of

TEMPLATES = ROOT / "book/slides"  # of nbconvert: `deck` is nbconvert's reveal, without a network
FILES = (  # beside the decks: the folder of a package, what is taken from it, and to where
    ("sphinx_revealjs", "_static/revealjs", ("dist", "plugin/notes", "LICENSE"), "reveal"),
    ("sphinx-mathjax-offline", "static/mathjax", ("tex-svg-full.js",), "mathjax"),
)
HEADING = re.compile(r'(<a id="[^"]*"></a>\s*)*#+ ')


def write(executed: Iterable[Path], place: Path) -> None:
    """Write a deck for each executed chapter to a folder, which is made anew."""
    from nbconvert import SlidesExporter  # only here: editions need no exporter

    shutil.rmtree(place, ignore_errors=True)
    for package, folder, names, target in FILES:
        found = find_spec(package)
        if found is None or not found.submodule_search_locations:
            raise Failure(f"Slides need the package {package} of environment.txt.")
        for name in names:
            source = Path(found.submodule_search_locations[0]) / folder / name
            (place / target / name).parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if source.is_dir() else shutil.copyfile)(source, place / target / name)
    exporter = SlidesExporter(
        config=Config(TemplateExporter={"extra_template_basedirs": [str(TEMPLATES)]}),
        template_name="deck",
        reveal_url_prefix="reveal",
        reveal_theme="white",  # one without fonts from elsewhere
        exclude_input=True,
        exclude_output_prompt=True,
    )
    for path in executed:
        notebook = deck(nbformat.read(path, 4))
        html, _ = exporter.from_notebook_node(notebook, {"metadata": {"name": path.stem}})
        (place / f"{path.stem}.html").write_text(html, "utf-8")


def deck(executed: Any) -> Any:
    """The cells of a chapter that a deck has, with the metadata by which nbconvert knows them."""
    executed.cells = [cell for cell in executed.cells if {"slide", "notes"} & {*tags_of(cell)}]
    for cell in executed.cells:
        kind = "notes" if "notes" in tags_of(cell) else "slide" if _begins(cell) else "-"
        cell.metadata["slideshow"] = {"slide_type": kind}
        cell.metadata["alt"] = cell.metadata.get("mystnb", {}).get("image", {}).get("alt", "")
    return executed


def _begins(cell: Any) -> bool:
    """Whether a slide begins with a cell."""
    shown = [output.get("data", {}).get("text/markdown", "") for output in cell.get("outputs", [])]
    text = cell.source if cell.cell_type == "markdown" else "".join(shown)
    return bool(HEADING.match(text)) or "goals" in tags_of(cell)
