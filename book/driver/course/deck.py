"""The slides of a chapter: some of its cells, chosen by their tags.

| tag | the cell |
|---|---|
| `slide` | begins a slide, and so does every heading within it |
| `fragment` | adds to the slide before it, at the next key |
| `notes` | is said and not shown |

Of a text, its first sentence, equations, lists, tables and code are shown under its heading, and
its paragraphs are for the speaker. Three slides of each deck need no tag: the title, the learning
goals and the exercises.
"""

import re
from base64 import b64decode
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from html import escape
from typing import Any

from driver.course.blocks import Piece, blocks, inline
from driver.page import live, pictures
from nmpcrl.course.exercises import Exercise, exercises
from nmpcrl.report.figures.sheet import MIME

TAGS = {"slide", "fragment", "notes"}
STYLE = re.compile(r"<style scoped>.*?</style>\s*", flags=re.S)
FILES = "files"  # beside the decks: all that they share
FIGURE = '<p class="figure"><img src="{}" alt="{}"></p>'
LIVE = '<div class="live-figure" data-prevent-swipe>{}</div>'
HEADS = "<tr><th>Exercise</th><th>Kind</th><th>Minutes</th><th>After it you can</th></tr>"
ROW = "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>"
SECTION = '<section id="{name}">\n<{head}>{title}</{head}>\n{shown}\n{notes}</section>'
NOTES = '<aside class="notes">\n{}\n</aside>\n'


class Unexecuted(ValueError):
    """A cell that a deck shows has no output: the last build of the book is older than its tag."""


@dataclass
class Slide:
    """A slide as HTML."""

    name: str  # of its cell, and in the address
    title: str
    shown: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)  # for the speaker

    def html(self, head: str) -> str:
        """The section of a deck."""
        notes = NOTES.format("\n".join(self.said)) if self.said else ""
        shown = "\n".join(self.shown)
        return SECTION.format(name=self.name, head=head, title=self.title, shown=shown, notes=notes)


@dataclass
class Deck:
    """The slides of a chapter and the files that they need, by path below `FILES`."""

    title: str
    slides: list[Slide]
    files: dict[str, bytes]

    def html(self) -> str:
        heads = ["h1", *["h2"] * len(self.slides)]
        return "\n".join(s.html(head) for s, head in zip(self.slides, heads, strict=False))


def deck(name: str, source: Any, executed: Any) -> Deck:
    """Make the slides of a chapter.

    Args:
        name: of the chapter, and of the folder of its figures.
        source: its notebook, which has the tags and the exercises.
        executed: the same, with the outputs that are shown.
    """
    outputs = {cell.id: cell.get("outputs", []) for cell in executed.cells}
    files: dict[str, bytes] = {}
    made: list[Slide] = []
    section = ""
    for cell in source.cells:
        tags = set(cell.metadata.get("tags", []))
        pieces = list(_pieces(cell, outputs.get(cell.id, []), files, name))
        if cell is source.cells[0]:
            made = _slides(cell, "", pieces)
        elif "goals" in tags:
            made.append(Slide(cell.id, "Learning goals", [h for k, h in pieces if k == "shown"]))
        elif "fragment" in tags:
            parts = [html for kind, html in pieces if kind == "shown"]
            made[-1].shown += [f'<div class="fragment">{html}</div>' for html in parts]
            made[-1].said += [html for kind, html in pieces if kind == "said"]
        elif "notes" in tags:
            made[-1].said += [html for kind, html in pieces if kind in ("shown", "said")]
        elif "slide" in tags:
            made += _slides(cell, section, pieces)
        section = ([section] + [html for kind, html in pieces if kind == "title"])[-1]
    every = list(exercises(source))
    minutes = sum(one.about.minutes for one in every)
    made[0].said.append(f"<p>{len(every)} exercises, together {minutes} minutes.</p>")
    return Deck(re.sub("<[^>]+>", "", made[0].title), [*made, _asked(every)], files)


def _slides(cell: Any, section: str, pieces: Iterable[Piece]) -> list[Slide]:
    """The slides of one cell, one for each of its headings."""
    made = [Slide(cell.id, section)]
    for kind, html in pieces:
        if kind == "title" and (made[-1].shown or made[-1].said):
            made.append(Slide(f"{cell.id}-{len(made) + 1}", html))
        elif kind == "title":
            made[-1].title = html
        else:
            (made[-1].said if kind == "said" else made[-1].shown).append(html)
    return made


def _asked(every: list[Exercise]) -> Slide:
    """The exercises: what each is about, and for the speaker what goes wrong."""
    rows = [
        ROW.format(o.number, o.about.kind, o.about.minutes, inline(o.about.goal)) for o in every
    ]
    wrong = [
        f"<li>Exercise {one.number}: {inline(mistake)}</li>"
        for one in every
        for mistake in one.about.mistakes
    ]
    said = ["<p>Common mistakes:</p>", "<ul>", *wrong, "</ul>"] if wrong else []
    return Slide("exercises", "Exercises", ["<table>", HEADS, *rows, "</table>"], said)


def _pieces(cell: Any, outputs: Any, files: dict[str, bytes], name: str) -> Iterator[Piece]:
    if cell.cell_type == "markdown":
        yield from blocks(cell.source)
    elif TAGS & set(cell.metadata.get("tags", [])):
        if not outputs:
            raise Unexecuted(f"{cell.id} has no output in the last build of the book")
        for output in outputs:
            yield from _output(cell, output.get("data", {}), files, name)


def _output(cell: Any, data: Any, files: dict[str, bytes], name: str) -> Iterator[Piece]:
    """What a cell displays, in the best of its forms."""
    if "image/png" in data:
        shown = data.get(MIME, {})
        svg = shown.get("wide", {}).get("svg")
        path = f"{name}/{cell.id}.{'svg' if svg else 'png'}"
        files[path] = svg.encode() if svg else b64decode(data["image/png"])
        form = cell.metadata["mystnb"]["image"]["alt"]
        alt = escape(pictures.alternative(shown.get("finding", ""), form))
        yield "shown", FIGURE.format(f"{FILES}/{path}", alt)
    elif "text/html" in data:
        yield "shown", _html(data["text/html"], files)
    elif "text/markdown" in data:
        yield from blocks(data["text/markdown"])
    elif "text/plain" in data:
        yield "shown", f"<pre>{escape(data['text/plain'])}</pre>"


def _html(html: str, files: dict[str, bytes]) -> str:
    """A table, or a live figure whose scripts and styles become files."""
    if not live.INLINE.search(html):
        return STYLE.sub("", html)

    def linked(found: re.Match[str]) -> str:
        path = f"live/{found['name']}"
        files[path] = found["text"].encode()
        return live.LINKS[found["kind"]].format(f"{FILES}/{path}")

    return LIVE.format(live.INLINE.sub(linked, html))
