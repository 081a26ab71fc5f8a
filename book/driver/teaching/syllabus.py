"""How long the book takes, and what needs what: chapters in, minutes and links out.

Minutes of reading are computed from a source: its words, formulas, figures and code. Those of the
exercises are the sum of what their metadata says. What a built page shows is counted in words. What
needs what is in `book/syllabus.yml`.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import nbformat
from bs4 import BeautifulSoup

from driver.page import enrich
from driver.project import ROOT, from_yaml
from driver.teaching.declared import Unknown, declared
from nmpcrl.course.exercises import Exercise, exercises

WORDS = 180  # read in a minute
FORMULA, FIGURE, CODE = 30, 60, 30  # on top of the words [s]
HEADING = re.compile(r"^(?=## )", flags=re.M)
LIVE = re.compile(r"\blive\.\w+\(")
NOT_READ = ("Exercises", "What we saw")  # counted by themselves, or repeated
WORD = re.compile(r"[^\W\d_]{2,}")
UNSEEN = (  # of a built page: folded, for a browser alone, or no words
    "details, .dropdown > :not(.admonition-title), figure.live, .math, .headerlink, .download,"
    " script, style"
)


@dataclass(frozen=True)
class Section:
    """A part of a chapter below one heading."""

    page: str  # such as "04_ges"
    title: str  # as in the chapter, formulas included
    seconds: float  # of reading
    live: int  # how many live figures it has

    @property
    def label(self) -> str:
        """Where the page has it: what `labelled` writes."""
        return label(self.page, self.title)

    @property
    def link(self) -> str:
        return f"[{self.title}](#{self.label})"


@dataclass(frozen=True, eq=False)
class Chapter:
    """A chapter, as whoever plans a course sees it."""

    page: str
    number: int
    title: str
    sections: tuple[Section, ...]
    exercises: tuple[Exercise, ...]

    @property
    def needs(self) -> tuple[Section, ...]:
        """The sections of other chapters that it needs."""
        wanted = declared().place(self.page).needs.items()
        return tuple(chapters()[page].section(one) for page, titles in wanted for one in titles)

    @property
    def alone(self) -> tuple[Section, ...]:
        """Those of its sections that need nothing."""
        return tuple(map(self.section, declared().place(self.page).alone))

    @property
    def link(self) -> str:
        return f"[Chapter {self.number}]({self.page}.ipynb)"

    @property
    def reading(self) -> int:
        """Minutes of reading, without its live figures."""
        return minutes(self.sections)

    @property
    def solving(self) -> int:
        """Minutes of its exercises, without the project."""
        return sum(one.about.minutes for one in self.exercises if one.about.kind != "project")

    @property
    def project(self) -> int:
        """Minutes of its project."""
        return sum(one.about.minutes for one in self.exercises if one.about.kind == "project")

    def section(self, title: str) -> Section:
        """The section of this title."""
        for one in self.sections:
            if one.title == title:
                return one
        raise Unknown(f"{self.page} has no section {title!r}")


def minutes(sections: tuple[Section, ...] | list[Section]) -> int:
    """Minutes of reading, rounded up."""
    return math.ceil(sum(one.seconds for one in sections) / 60)


def label(page: str, title: str) -> str:
    words = re.findall(r"[a-z0-9]+", re.sub(r"\\boldsymbol|\\mathbf", "", title.lower()))
    return "-".join(["section", re.sub(r"^\d+_", "", page).replace("_", "-"), *words])


def chapter(page: str, number: int, notebook: Any) -> Chapter:
    """What a source says of its chapter."""
    title = notebook.cells[0].source.splitlines()[0].removeprefix("# ")
    return Chapter(
        page, number, title, tuple(_sections(page, notebook)), tuple(exercises(notebook))
    )


@cache
def chapters() -> dict[str, Chapter]:
    """The numbered chapters by page, in the order of _toc.yml."""
    parts = from_yaml("_toc.yml")["parts"]
    numbered = [one["file"] for part in parts if part.get("numbered") for one in part["chapters"]]
    pages = [Path(file).name for file in numbered]
    return {
        page: chapter(page, number, nbformat.read(ROOT / "book" / f"{page}.ipynb", 4))
        for number, page in enumerate(pages, 1)
    }


def _sections(page: str, notebook: Any) -> Iterator[Section]:
    title, spent, live = "", 0.0, 0
    for cell in [*notebook.cells, nbformat.v4.new_markdown_cell("## End")]:
        is_text = cell.cell_type == "markdown"
        for source in HEADING.split(cell.source) if is_text else [cell.source]:
            if is_text and (found := re.match("## +(.+)", source)):
                if title and title not in NOT_READ:
                    yield Section(page, title, spent, live)
                title, spent, live = found[1].strip(), 0.0, 0
            spent += seconds(cell, source)
            live += not is_text and bool(LIVE.search(source))


def seconds(cell: Any, source: str) -> float:
    """How long it takes to read a part of a cell's source, and to look at what the cell shows."""
    tags = cell.metadata.get("tags", [])
    if {"exercise", "hint", "solution", "rubric", "remove-cell"} & set(tags):
        return 0.0
    if cell.cell_type == "markdown" or enrich.says(source):
        words = len(WORD.findall(source))
        return 60 * words / WORDS + source.count("$$") / 2 * FORMULA
    if "mystnb" in cell.metadata:
        return FIGURE
    return 0.0 if "hide-input" in tags else CODE


def shown(page: str) -> int:
    """The words that a built page, HTML, shows before anything is unfolded, code and output too.

    Formulas have no words; exercises are counted by themselves.
    """
    article = BeautifulSoup(page, "html.parser").article
    assert article
    for section in article.find_all("section"):
        if section.h2 and section.h2.get_text().startswith("Exercises") and not section.h1:
            section.decompose()
    for element in article.select(UNSEEN):
        element.decompose()
    return len(WORD.findall(article.get_text(" ")))
