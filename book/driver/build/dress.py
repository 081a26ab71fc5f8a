"""What the pages of a build have beyond their sources and outputs."""

from collections.abc import Iterable
from pathlib import Path

import nbformat

from driver.page import enrich, live, pictures, questions
from driver.project import notebooks


def dress(source: Path, executed: Iterable[Path]) -> None:
    """Give the pages of the mirror what they have beyond their sources."""
    read = {path: nbformat.read(source / path, 4) for path in notebooks().values()}

    shared = source / "book/_static/live"

    def output(page: str, tag: str) -> str:
        return live.linked(enrich.output(read[Path("book") / page], tag), Path("book/page"), shared)

    (source / "book" / pictures.FOLDER).mkdir(exist_ok=True)
    live.add_runs(read.values(), shared)
    for path in source.glob("book/*.md"):
        text = pictures.beside(path.read_text("utf-8"), path.parent)
        path.write_text(enrich.page(text, output))
    for path, notebook in read.items():
        live.share(notebook, path, shared)
        download = path.name if path in executed else ""
        dressed = enrich.notebook(questions.placed(notebook), download)
        for name, data in pictures.placed(dressed).items():
            (source / "book" / pictures.FOLDER / name).write_bytes(data)
        nbformat.write(dressed, source / path)
