"""What the pages of a build have beyond their sources and outputs."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import nbformat

from driver.page import enrich, live, prose, questions
from driver.project import notebooks


def dress(source: Path, executed: Iterable[Path]) -> None:
    """Give the pages of the mirror what they have beyond their sources."""
    read = {path: nbformat.read(source / path, 4) for path in notebooks().values()}
    shared = source / "book/_static/live"

    def output(page: str, tag: str) -> str:
        shown = prose.displayed(read[Path("book") / page], tag)
        return live.linked(shown, Path("book/page"), shared)

    live.add_runs(read.values(), shared)
    for path in source.glob("book/*.md"):
        path.write_text(enrich.text(prose.filled(path.read_text("utf-8"), output)))
    for path, notebook in read.items():
        live.share(notebook, path, shared)
        describe(notebook)
        download = path.name if path in executed else ""
        dressed = enrich.notebook(questions.placed(notebook), download)
        nbformat.write(dressed, source / path)


def describe(notebook: Any) -> None:
    """Let the alternative text of each figure begin with what it found, its title."""
    for cell in notebook.cells:
        image = cell.metadata.get("mystnb", {}).get("image", {})
        for out in cell.get("outputs", []) if "alt" in image else []:
            if finding := out.get("data", {}).get("text/plain", "").rstrip(". "):
                end = "" if finding.endswith(("!", "?")) else "."
                image["alt"] = f"{finding}{end} {image['alt']}"
