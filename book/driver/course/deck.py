r"""The slides of a unit: a text of `book/decks`, with what the unit's chapter has computed.

| in the text | on the slides |
|---|---|
| `# Title` | the unit's, as in `syllabus.yml`; below it, a question and its answer |
| `## Sentence` | begins a slide |
| `![](#eq-bellman)` | a formula of the chapter, by its label |
| `![](#sum-code)` | what a cell displays; of a text its table, or all of it |
| `![](for_reviewers.ipynb#time)` | what a cell of another page displays |
| `![ES GES](#time)` | of a table, the rows whose first cell has one of these words |
| `{loop-said.cost}` | what the cell `loop-said` says in the place of `cost` |
| `> ...` | is said and not shown |

The goals, the minutes and the exercises are those of the course's plan.
"""

import re
from base64 import b64decode
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from html import escape
from itertools import chain
from typing import Any

from driver.course.blocks import blocks, inline
from driver.page import live, pictures
from driver.teaching.plans import LIVE, UNIT, Unit
from nmpcrl.report import prose
from nmpcrl.report.figures.sheet import MIME
from nmpcrl.report.live import published_runs

PART = re.compile(r"^(?=##? )", flags=re.M)
NUMBER = re.compile(r"\{(?P<cell>[a-z\d][a-z\d-]*)\.(?P<name>[a-z_]\w*)\}")
LINE = re.compile(r"<tr.*?</tr>\s*", flags=re.S)  # of a table
FIRST = re.compile(r"<t[hd].*?</t[hd]>", flags=re.S)
STYLE = re.compile(r"<style scoped>.*?</style>\s*", flags=re.S)
ELSEWHERE = re.compile(r"!\[[^]]*\]\((?P<page>\w+)\.ipynb#")
FILES = "files"  # beside the decks: all that they share
FIGURE = '<p class="figure"><img src="{}" alt="{}"></p>'
BOX = '<div class="live-figure" data-prevent-swipe>{}</div>'
HEADS = "<tr><th>Exercise</th><th>Kind</th><th>Minutes</th><th>After it you can</th></tr>"
ROW = "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>"
SECTION = """<section id="{name}">
<{head}>{title}</{head}>
<div class="body">
{shown}
</div>
<aside class="notes">
{said}
</aside>
</section>"""


class NotThere(ValueError):
    """A text shows what its chapter lacks, or did not compute; the message says what."""


@dataclass
class Slide:
    """A slide as HTML."""

    title: str
    shown: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)  # for the speaker

    @property
    def live(self) -> bool:
        return any('class="live-figure"' in html for html in self.shown)

    def html(self, head: str) -> str:
        """The section of a deck."""
        name = "-".join(re.findall(r"[a-z\d]+", re.sub(r"\\\w+", "", self.title.lower())))
        shown, said = "\n".join(self.shown), "\n".join(self.said)
        return SECTION.format(name=name, head=head, title=self.title, shown=shown, said=said)


@dataclass
class Deck:
    """The slides of a unit and the files that they need, by path below `FILES`."""

    title: str
    slides: list[Slide]
    files: dict[str, bytes]

    def html(self) -> str:
        first, *others = self.slides
        return "\n".join([first.html("h1"), *(slide.html("h2") for slide in others)])


def pages(text: str, unit: Unit) -> list[str]:
    """The pages that a text shows something of, the unit's chapter first."""
    return list(dict.fromkeys([unit.sections[0].page, *ELSEWHERE.findall(text)]))


def deck(text: str, unit: Unit, executed: Mapping[str, Any]) -> Deck:
    """Make the slides of a unit.

    Args:
        text: of `book/decks`.
        unit: of the plan.
        executed: the notebooks of `pages`, by name, with the outputs that are shown.

    Raises:
        NotThere: a page has not what the text shows.
    """
    shown = {name: Chapter(name, executed[name]) for name in pages(text, unit)}
    first, *taught, seen = (_slide(part, shown) for part in PART.split(text) if part)
    first.said.insert(0, f"<p>{_spent(unit)}</p>")
    for slide, minutes in zip(taught, _timed(unit, taught), strict=True):
        slide.said.insert(0, f"<p><b>{minutes}</b></p>")
    slides = [first, _goals(unit), *taught, _exercises(unit), seen]
    files = {path: data for page in shown.values() for path, data in page.files.items()}
    return Deck(first.title, slides, files)


class Chapter:
    """What an executed page has to show, and the files that this takes."""

    def __init__(self, name: str, executed: Any) -> None:
        self.name = name
        self.files: dict[str, bytes] = {}
        self._cells = {cell.id: cell for cell in executed.cells}

    def number(self, found: re.Match[str]) -> str:
        """What a cell says in the place of a name."""
        cell = self._cell(found["cell"])
        texts = [one.data["text/markdown"] for one in cell.outputs if "text/markdown" in one.data]
        numbers = prose.said(cell.source, texts)
        if found["name"] not in numbers:
            raise NotThere(f"the cell {cell.id} of {self.name} says no {found['name']}")
        return numbers[found["name"]]

    def shown(self, label: str) -> Iterator[str]:
        """A formula by its label, or what the cell of this name displays."""
        if label.startswith("eq-"):
            yield self._formula(label)
            return
        cell = self._cell(label)
        if cell.cell_type == "markdown":
            pieces = list(blocks(cell.source))
            tables = [html for kind, html in pieces if kind == "table"]
            yield from tables or [html for _, html in pieces]
        elif not cell.outputs:
            raise NotThere(f"the cell {label} of {self.name} has no output")
        else:
            for output in cell.outputs:
                yield from self._output(cell, output)

    def _cell(self, name: str) -> Any:
        if name not in self._cells:
            raise NotThere(f"{self.name} has no cell {name}")
        return self._cells[name]

    def _formula(self, label: str) -> str:
        formula = re.compile(rf'<a id="{label}"></a>\s*(\$\$.*?\$\$)', flags=re.S)
        for cell in self._cells.values():
            if cell.cell_type == "markdown" and (found := formula.search(cell.source)):
                return next(html for _, html in blocks(found[1]))
        raise NotThere(f"{self.name} has no formula {label}")

    def _output(self, cell: Any, output: Any) -> Iterator[str]:
        """What a cell displays, in the best of its forms."""
        data = output.get("data", {})
        if "image/png" in data:
            yield self._figure(cell, data)
        elif "text/html" in data:
            yield self._html(data["text/html"])
        elif "text/markdown" in data:
            yield from (html for _, html in blocks(data["text/markdown"]))
        elif text := data.get("text/plain", output.get("text")):
            yield f"<pre>{escape(text.strip())}</pre>"

    def _figure(self, cell: Any, data: Any) -> str:
        """A figure as it is drawn for slides, if it is too high for one."""
        shown = data.get(MIME, {})
        drawn = shown.get("slide") or shown.get("wide", {})
        svg = drawn.get("svg")
        path = f"{self.name}/{cell.id}.{'svg' if svg else 'png'}"
        png = drawn.get("png") or data["image/png"]
        self.files[path] = svg.encode() if svg else b64decode(png)
        form = cell.metadata["mystnb"]["image"]["alt"]
        alt = pictures.alternative(shown.get("finding", ""), form)
        return FIGURE.format(f"{FILES}/{path}", escape(alt))

    def _html(self, html: str) -> str:
        """A table, or a live figure whose scripts and styles become files."""
        if not live.INLINE.search(html):
            return STYLE.sub("", html)

        def linked(found: re.Match[str]) -> str:
            path = f"live/{found['name']}"
            self.files[path] = found["text"].encode()
            return live.LINKS[found["kind"]].format(f"{FILES}/{path}")

        if live.ASKS in html:
            runs = published_runs.scripts().items()
            self.files |= {f"live/{name}": text.encode() for name, text in runs}
        return BOX.format(live.INLINE.sub(linked, html))


def _slide(part: str, pages: Mapping[str, Chapter]) -> Slide:
    """The slide of a part of a text, which begins with its heading; the first page is its own."""
    chapter = next(iter(pages.values()))
    head, _, body = NUMBER.sub(chapter.number, part).partition("\n")
    slide = Slide(inline(head.lstrip("# ")))
    for kind, html in blocks(body):
        if kind == "quote":
            slide.said.append(html)
        elif kind == "image":
            address, *words = html.split()
            page, _, label = address.partition("#")
            source = pages[page.removesuffix(".ipynb")] if page else chapter
            slide.shown += [_rows(shown, words) for shown in source.shown(label)]
        else:
            slide.shown.append(html)
    return slide


def _rows(table: str, words: list[str]) -> str:
    """A table with the rows whose first cell has one of these words; without words, all."""

    def kept(row: re.Match[str]) -> str:
        first = re.sub("<[^>]+>", " ", FIRST.findall(row[0])[0]).split()
        return row[0] if "<td" not in row[0] or {*words} & {*first} else ""

    return LINE.sub(kept, table) if words else table


def _spent(unit: Unit) -> str:
    """The minutes of a unit, in words."""
    parts = [f"{name} {minutes}" for name, minutes in unit.minutes.items() if minutes]
    return f"Minutes: {', '.join(parts)}; {UNIT - unit.total} are left for questions."


def _timed(unit: Unit, slides: list[Slide]) -> Iterator[str]:
    """From when to when each slide is shown, if those of the lecture take equally long."""
    lecture = unit.minutes["lecture"] / sum(not slide.live for slide in slides)
    begins = 0.0
    for slide in slides:
        ends = begins + (LIVE if slide.live else lecture)
        yield f"Minutes {begins:.0f} to {ends:.0f}."
        begins = ends


def _goals(unit: Unit) -> Slide:
    items = [f"<li>{inline(goal)}</li>" for goal in unit.goals]
    return Slide("After this unit you can", ["<ul>", *items, "</ul>"])


def _exercises(unit: Unit) -> Slide:
    """The exercises: what each is about, and for the speaker what goes wrong."""
    kinds = [(one, "") for one in unit.exercises] + [(one, ", at home") for one in unit.homework]
    rows = [
        ROW.format(one.number, one.about.kind + where, one.about.minutes, inline(one.about.goal))
        for one, where in kinds
    ]
    shown = ['<table class="exercises">', HEADS, *rows, "</table>"] * bool(rows)
    others = {"Discussion": unit.discussion.about, "At home": unit.besides}
    shown += [f"<p>{name}: {inline(text)}</p>" for name, text in others.items() if text]
    wrong = chain.from_iterable(
        [f"<li>Exercise {one.number}: {inline(mistake)}</li>" for mistake in one.about.mistakes]
        for one, _ in kinds
    )
    return Slide("Exercises", shown, ["<p>Common mistakes:</p>", "<ul>", *wrong, "</ul>"])
