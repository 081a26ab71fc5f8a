"""Exercises as they stand in a notebook: groups of tagged cells, one after the other.

| tag | cell | holds |
|---|---|---|
| `exercise` | Markdown | a label `<a id="ex-..."></a>`, the bold number, minutes and points, the question |
| `hint` | Markdown | a folded `Hint 1`; one to three, from a nudge to the method |
| `given` | code | what the exercise starts from, if anything |
| `answer` | code | `name = ...`, or a function that returns `...` or is wrong; then the solution |
| `check` | code | `check.name(name)`, a function of `nmpcrl.course.checks` |
| `solution` | Markdown | the folded reasoning behind the solution |

A solution is code between `### BEGIN SOLUTION` and `### END SOLUTION`, which nbgrader takes out, too.
"""  # noqa: E501

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

Cell = Any  # nbformat's, a dictionary with attributes
Notebook = Any

PARTS = ("hint", "given", "answer", "check", "solution")
HEAD = re.compile(
    r'<a id="ex-(?P<name>[\w-]+)"></a>\n'
    r"\*\*Exercise (?P<number>[\d.]+)\.\*\* \*\d+ minutes?, (?P<points>\d+) points?\.\* "
)
SOLUTION = re.compile(r"\n*^### BEGIN SOLUTION\n(.*?)\n+### END SOLUTION$\n?", flags=re.M | re.S)


class NoExercise(ValueError):
    """A group of cells is no exercise; the message names it and what it lacks."""


@dataclass(frozen=True, eq=False)
class Exercise:
    """An exercise and its cells."""

    name: str  # of its label, without "ex-"
    number: str  # such as "1.2"
    points: int
    text: Cell
    parts: dict[str, list[Cell]] = field(default_factory=dict)  # by tag

    @property
    def cells(self) -> list[Cell]:
        """All cells of the exercise."""
        return [self.text, *chain.from_iterable(self.parts.values())]

    @property
    def solution(self) -> str:
        """The code of the solution."""
        return "\n\n".join(
            code for cell in self.parts["answer"] for code in SOLUTION.findall(cell.source)
        )


def exercises(notebook: Notebook) -> Iterator[Exercise]:
    """The exercises of a notebook in their order.

    Raises:
        NoExercise: a cell tagged `exercise` does not begin with label, number, minutes and points.
    """
    group: list[Cell] = []
    for cell in [*notebook.cells, None]:
        if group and (cell is None or not _part(cell)):
            yield _exercise(group)
            group = []
        if cell is not None and (group or "exercise" in tags_of(cell)):
            group.append(cell)


def tags_of(cell: Cell) -> list[str]:
    """The tags of a cell."""
    tags: list[str] = cell.metadata.get("tags", [])
    return tags


def _part(cell: Cell) -> str:
    return next((part for part in PARTS if part in tags_of(cell)), "")


def _exercise(group: list[Cell]) -> Exercise:
    text, *rest = group
    head = HEAD.match(text.source)
    if head is None:
        begins = text.source[:60]
        raise NoExercise(f"{begins!r} does not begin with a label, a number, minutes and points")
    parts: dict[str, list[Cell]] = {part: [] for part in PARTS}
    for cell in rest:
        parts[_part(cell)].append(cell)
    return Exercise(head["name"], head["number"], int(head["points"]), text, parts)


def clear_solutions(notebook: Notebook) -> None:
    """Take the solutions out of the answers of a notebook, in place, as nbgrader does."""
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.source = SOLUTION.sub("", cell.source)
