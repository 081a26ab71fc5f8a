"""What the pages "Teach with it" and "Learn alone" show of the syllabus, and the head of a chapter.

In a source stands `<!-- syllabus: plan two-weeks -->`; a page has what the function in `PARTS`
returns, as MyST, whose links Sphinx checks.
"""

import re
from collections.abc import Callable
from typing import Any

from driver.project import from_yaml
from driver.teaching import graph
from driver.teaching.plans import LIVE, PACE, UNIT, Unit, plan
from driver.teaching.self_test import self_test
from driver.teaching.syllabus import (
    FIGURE,
    FORMULA,
    WORDS,
    Chapter,
    chapters,
    declared,
    declared_of,
    label,
)

PART = re.compile(r"<!-- syllabus: (?P<name>[\w-]+) ?(?P<of>[\w-]*) -->")
HEADING = re.compile(r"^## +(?P<title>.+)$", flags=re.M)


def filled(markdown: str) -> str:
    """A page with the parts that its comments name."""
    return PART.sub(lambda found: PARTS[found["name"]](*filter(None, [found["of"]])), markdown)


def headed(notebook: Any, page: str) -> None:
    """Give each section of a dressed notebook a label and, below the title, what it takes."""
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            cell.source = HEADING.sub(
                lambda found: f"({label(page, found['title'])})=\n{found[0]}", cell.source
            )
    if page in chapters():
        first, _, rest = notebook.cells[0].source.partition("\n")
        notebook.cells[0].source = f"{first}\n\n{head(chapters()[page])}\n{rest}"


def head(chapter: Chapter) -> str:
    """How long a chapter takes and what it needs."""
    times = [f"Reading {chapter.reading} min"]
    times += [f"exercises {chapter.solving} min"] if chapter.solving else []
    times += [f"project {chapter.project} min"] if chapter.project else []
    pages = dict.fromkeys(one.page for one in chapter.needs)
    needs = listed([chapters()[page].link for page in pages])
    needs = needs or "what the [self-test](#teach-self-test) asks"
    alone = [one.link for one in chapter.alone]
    also = f"; {listed(alone)} need{'s' * (len(alone) == 1)} nothing before" if alone else ""
    return f"{{.chapter-head}}\n{', '.join(times)}; needs: {needs}{also}."


def listed(words: list[str]) -> str:
    *most, last = words or [""]
    return f"{', '.join(most)} and {last}" if most else last


def overview(name: str) -> str:
    """The units of a plan as a table."""
    units = plan(name)
    columns = list(units[0].minutes)
    head = f"| unit | {' | '.join(columns)} | sum |\n|---|{'---:|' * (len(columns) + 1)}"
    rows = [
        f"| {k}. {unit.title} | {' | '.join(str(n or '') for n in unit.minutes.values())} "
        f"| {unit.total} |"
        for k, unit in enumerate(units, 1)
    ]
    sums = [sum(unit.minutes[column] for unit in units) for column in columns]
    rows.append(f"| Sum | {' | '.join(map(str, sums))} | {sum(sums)} |")
    return "\n".join([head, *rows])


def units(name: str) -> str:
    """Each unit of a plan."""
    return "\n\n".join(_unit(k, one) for k, one in enumerate(plan(name), 1))


def _unit(number: int, unit: Unit) -> str:
    spent = unit.minutes
    minutes = sum(one.about.minutes for one in unit.homework)
    homework = [_exercises(unit.homework), f"That takes {minutes} min." * bool(minutes)]
    lines = {
        "Goals": f"after it one can {listed(list(unit.goals))}.",
        f"Sections, {spent['lecture']} min": _linked(unit.sections),
        f"Live figure, {spent['live figures']} min": _linked(unit.live),
        f"Exercises, {spent['exercises']} min": _exercises(unit.exercises),
        f"Discussion, {spent['discussion']} min": unit.discussion[1],
        "Homework": " ".join(filter(None, [*homework, unit.besides])),
        "Left out of the course": _linked(unit.left_out),
    }
    said = "\n".join(f"- **{name}:** {text}" for name, text in lines.items() if text)
    rest = UNIT - unit.total
    free = f", {rest} left for questions" if rest else ""
    return (
        f"::::{{admonition}} {number}. {unit.title}\n:class: dropdown\n\n"
        f"{said}\n\n*{unit.total} of {UNIT} minutes{free}.*\n::::"
    )


def _linked(sections: Any) -> str:
    """Links to sections, each chapter by its number before those of it."""
    pages = dict.fromkeys(one.page for one in sections)
    by_chapter = (
        f"{chapters()[page].link}: " + "; ".join(one.link for one in sections if one.page == page)
        for page in pages
    )
    text = ". ".join(by_chapter)
    return text and (text if text.endswith(("?)", ".")) else f"{text}.")


def _exercises(some: Any) -> str:
    return some and f"{listed([f'{{ref}}`ex-{one.name}`' for one in some])}."


def rates() -> str:
    """How the minutes were counted."""
    return (
        f"Minutes of reading count {WORDS} words a minute, {FORMULA} seconds more for a formula"
        f" that stands alone and {FIGURE} for a figure. A lecture takes {PACE} times as long as"
        f" reading, and a live figure {LIVE} minutes."
    )


def needs() -> str:
    """Which sections a chapter needs, as a list."""
    return "\n".join(map(_needs, chapters().values()))


def _needs(chapter: Chapter) -> str:
    pages = dict.fromkeys(one.page for one in chapter.needs)
    sections = (
        f"from {chapters()[page].link}, "
        + listed([one.link for one in chapter.needs if one.page == page])
        for page in pages
    )
    line = f"- {chapter.link} needs {'; '.join(sections) or 'no other chapter'}."
    alone = listed([one.link for one in chapter.alone])
    return line + f" Its sections {alone} need nothing before." * bool(alone)


def drawn() -> str:
    """The graph of chapters."""
    said = declared()["chapters"]
    names = {page: (str(chapters()[page].number), one["short"]) for page, one in said.items()}
    edges = {page: list(declared_of(page)["needs"]) for page in chapters()}
    return graph.svg(names, edges)


def path() -> str:
    """The steps of "Learn alone"; `book/_static/path.js` gives each a box to check."""
    parts = []
    for part in declared()["path"]:
        steps = [*part.get("steps", ()), *(s for p in part.get("chapters", ()) for s in _steps(p))]
        lines = "\n".join(f"- {step}" for step in steps)
        parts.append(f"## {part['title']}\n\n::::{{div}} path\n{lines}\n::::")
    return "\n\n".join(parts)


def _steps(page: str) -> list[str]:
    chapter = chapters()[page]
    solve = f"[Exercises of Chapter {chapter.number}](#{label(page, 'Exercises')})"
    read = [f"{chapter.link}, {chapter.reading} min: {chapter.title.rstrip('.')}"]
    live = [
        f"Live figure: {one.link}, {LIVE * one.live} min" for one in chapter.sections if one.live
    ]
    minutes = f"{solve}, {chapter.solving} min"
    return read + live + ([minutes] if chapter.exercises else [])


def citation() -> str:
    """The entry of CITATION.cff for BibTeX."""
    entry = from_yaml("CITATION.cff")
    fields = {
        "author": " and ".join(f"{{{one['name']}}}" for one in entry["authors"]),
        "title": f"{{{entry['title']}}}",
        "version": entry["version"],
        "note": f"License {entry['license']}",
    }
    lines = "\n".join(f"  {name} = {{{text}}}," for name, text in fields.items())
    return f"```bibtex\n@software{{nmpcrl,\n{lines}\n}}\n```"


PARTS: dict[str, Callable[..., str]] = {
    "overview": overview,
    "units": units,
    "rates": rates,
    "needs": needs,
    "graph": drawn,
    "self-test": self_test,
    "path": path,
    "citation": citation,
}
