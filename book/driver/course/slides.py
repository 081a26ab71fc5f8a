"""A deck for each unit of the course that has a text in `book/decks`: part of `make course`.

It shows figures, numbers and equations as the last build of the book has them, and needs no
network: reveal.js and MathJax are copied from the packages sphinx-revealjs and
sphinx-mathjax-offline. Keys: arrows move, S opens the speaker's window, N shows the notes here,
and `?print-pdf` prints.
"""

import re
import shutil
from collections.abc import Iterable, Iterator
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import nbformat

from driver.course import deck
from driver.course.deck import FILES
from driver.paper import pdf
from driver.project import ROOT, Failure
from driver.teaching.plans import Unit, plan

EXECUTED = Path("_build/executed")
TEXTS, PLAN = ROOT / "book/decks", "two-weeks"
PACKAGES = {  # where its files are, and which of them a deck takes
    "sphinx_revealjs": (
        "_static/revealjs",
        ("dist/reveal.css", "dist/reveal.js", "plugin/notes/notes.js", "LICENSE"),
    ),
    "sphinx-mathjax-offline": ("static/mathjax", ("tex-svg-full.js",)),
}
OWN = ("deck.css", "deck.js")
DATE = re.compile(rb"(?<=Date \(D:)\d{14}")  # when a PDF was made
LANDSCAPE: Any = {"width": 1280, "height": 720}  # [px]
PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<link rel="stylesheet" href="{files}/reveal.css">
<link rel="stylesheet" href="{files}/deck.css">
<noscript><style>.reveal .slides > section {{ display: block; position: static }}</style></noscript>
</head>
<body>
<main class="reveal"><div class="slides">
{slides}
</div></main>
<script src="{files}/reveal.js"></script>
<script src="{files}/notes.js"></script>
<script src="{files}/deck.js"></script>
<script src="{files}/tex-svg-full.js"></script>
</body>
</html>
"""


def units() -> Iterator[tuple[str, str, Unit]]:
    """Each unit of the plan that has a text: the name of its deck, the text, and the unit."""
    texts = {path.stem: path.read_text("utf-8") for path in sorted(TEXTS.glob("*.md"))}
    named = {text.partition("\n")[0].removeprefix("# "): name for name, text in texts.items()}
    for unit in plan(PLAN):
        if unit.title in named:
            name = named[unit.title]
            yield name, texts[name], unit


def make(executed: Path, place: Path) -> list[Path]:
    """Write a deck for each unit to a folder, which is made anew; the decks.

    Raises:
        Failure: a chapter was not executed, or a package is not installed.
    """
    shutil.rmtree(place, ignore_errors=True)
    (place / FILES).mkdir(parents=True)
    for package, (folder, names) in PACKAGES.items():
        copy(package, folder, names, place / FILES)
    for name in OWN:
        shutil.copyfile(ROOT / "book/_static/deck" / name, place / FILES / name)
    return [write(name, text, unit, executed, place) for name, text, unit in units()]


def write(name: str, text: str, unit: Unit, executed: Path, place: Path) -> Path:
    """Write one deck and the files that it alone needs, or the live figures share."""
    notebooks = {page: executed / f"{page}.ipynb" for page in deck.pages(text, unit)}
    for notebook in notebooks.values():
        if not notebook.exists():
            raise Failure(f"Slides show what {notebook.name} computes: `make book` executes it.")
    shown = {page: nbformat.read(notebook, 4) for page, notebook in notebooks.items()}
    try:
        made = deck.deck(text, unit, shown)
    except deck.NotThere as error:
        raise Failure(f"book/decks/{name}.md: {error}; is the last build older?") from error
    for path, data in made.files.items():
        target = place / FILES / path
        target.parent.mkdir(exist_ok=True)
        target.write_bytes(data)
    page = PAGE.format(title=escape(made.title, False), slides=made.html(), files=FILES)
    target = place / f"{name}.html"
    target.write_text(page, "utf-8")
    return target


def copy(package: str, folder: str, names: Iterable[str], place: Path) -> None:
    """Copy files of an installed package, without importing it."""
    found = find_spec(package)
    if found is None or not found.submodule_search_locations:
        raise Failure(f"Slides need the package {package} of environment.txt.")
    for name in names:
        source = Path(found.submodule_search_locations[0]) / folder / name
        target = f"{package}-LICENSE" if source.name == "LICENSE" else source.name
        shutil.copyfile(source, place / target)


def printed(decks: Iterable[Path]) -> list[Path]:
    """Each deck as a PDF beside it, one slide a page, with the version's date, by a Chromium."""
    browser, date = pdf.chromium(), f"{pdf.version()[1]:%Y%m%d%H%M%S}".encode()
    from playwright.sync_api import sync_playwright  # only here: a refusal should not wait for it

    made = []
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=browser, args=pdf.FLAGS) as chromium,
    ):
        for path in decks:
            tab = pdf.opened(chromium, LANDSCAPE)
            tab.goto(f"{path.resolve().as_uri()}?print-pdf")
            tab.wait_for_selector("html[data-ready] .pdf-page", state="attached")
            printed = tab.pdf(prefer_css_page_size=True, print_background=True)
            made.append(path.with_suffix(".pdf"))
            made[-1].write_bytes(DATE.sub(date, printed))
            tab.close()
    return made
