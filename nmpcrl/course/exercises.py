"""Exercises as they stand in a notebook: groups of tagged cells, one after the other.

| tag | cell | holds |
|---|---|---|
| `exercise` | Markdown | a label `<a id="ex-..."></a>`, the bold number, the question; `About` as metadata |
| `note` | Markdown | in the edition for teachers: the goal, and what goes wrong |
| `hint` | Markdown | a folded `Hint 1`; one to three, from a nudge to the method |
| `given` | code | what the exercise starts from, if anything |
| `answer` | code | `name = ...`, or a function that returns `...` or is wrong |
| `check` | code | `check.name(name)`, a function of `nmpcrl.course.checks` |
| `rubric` | Markdown | a folded rubric, in place of a check, for a project |
| `solution` | Markdown | a folded solution with one ```` ```python ```` block for each answer cell |

The code of a solution stands there once: `solved` puts it in the place of the empty answers.
"""  # noqa: E501

import re
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass, field, fields
from typing import Any

Cell = Any  # nbformat's, a dictionary with attributes
Notebook = Any

KINDS = ("by hand", "read", "code", "find the bug", "project")
LEVELS = (1, 2, 3)
PARTS = ("note", "hint", "given", "answer", "check", "rubric", "solution")
HEAD = re.compile(r'<a id="ex-(?P<name>[\w-]+)"></a>\n\*\*Exercise (?P<number>[\d.]+)\.\*\* ?')
CODE = re.compile(r"^```python\n(.*?)\n```$", flags=re.M | re.S)
OURS, OPEN = "nmpcrl", "unanswered"  # keys of a cell's metadata


class NoExercise(ValueError):
    """A group of cells is no exercise; the message says which one and why."""


@dataclass(frozen=True)
class About:
    """What the metadata of an exercise says of it."""

    kind: str  # one of KINDS
    level: int  # one of LEVELS
    minutes: int
    points: int
    goal: str  # what one can do after it
    mistakes: tuple[str, ...] = ()  # common ones, for whoever teaches
    counts: bool = True  # if not, it is practice: others have published its answer

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise NoExercise(f"kind {self.kind!r} is none of {', '.join(KINDS)}")
        if self.level not in LEVELS:
            raise NoExercise(f"level {self.level!r} is none of 1, 2 and 3")
        if min(self.minutes, self.points) < 1 or not self.goal:
            raise NoExercise("minutes and points must be 1 or more, and the goal a sentence")

    @property
    def worth(self) -> int:
        """The points that it counts."""
        return self.points if self.counts else 0

    @property
    def line(self) -> str:
        """What a reader sees of it, such as "By hand · level 1 of 3 · 5 minutes · 1 point"."""
        kind = self.kind[0].upper() + self.kind[1:]
        counted = {"minute": self.minutes} | ({"point": self.points} if self.counts else {})
        plural = [f"{n} {word}" + ("s" if n > 1 else "") for word, n in counted.items()]
        practice = [] if self.counts else ["practice"]
        return " · ".join([kind, f"level {self.level} of {LEVELS[-1]}", *plural, *practice])


@dataclass(frozen=True, eq=False)
class Exercise:
    """An exercise and its cells."""

    name: str  # of its label, without "ex-"
    number: str  # such as "1.2"
    about: About
    text: Cell
    parts: dict[str, list[Cell]] = field(default_factory=dict)  # by tag

    @property
    def answers(self) -> list[str]:
        """The code of the solution, one for each answer cell."""
        return [code for cell in self.parts["solution"] for code in CODE.findall(cell.source)]


def exercises(notebook: Notebook) -> Iterator[Exercise]:
    """The exercises of a notebook in their order.

    Raises:
        NoExercise: a group of cells lacks a part, or has one too many.
    """
    group: list[Cell] = []
    for cell in [*notebook.cells, None]:
        if group and (cell is None or not _part(cell)):
            yield _exercise(group)
            group = []
        if cell is not None and (group or about(cell)):
            group.append(cell)


def about(cell: Cell) -> dict[str, Any] | None:
    """What the metadata says of the exercise that begins here, if one does."""
    found: dict[str, Any] | None = cell.metadata.get(OURS, {}).get("exercise")
    return found


def _part(cell: Cell) -> str:
    tags = cell.metadata.get("tags", [])
    return next((part for part in PARTS if part in tags), "")


def _exercise(group: list[Cell]) -> Exercise:
    text, *rest = group
    head = HEAD.match(text.source)
    if head is None:
        raise NoExercise(f"{text.source[:60]!r} does not begin with a label and a number")
    parts: dict[str, list[Cell]] = {part: [] for part in PARTS}
    for cell in rest:
        parts[_part(cell)].append(cell)
    given: dict[str, Any] = dict(about(text) or {})
    if wrong := set(given) - {one.name for one in fields(About)}:
        raise NoExercise(f"Exercise {head['number']} has {min(wrong)!r} in its metadata")
    given["mistakes"] = tuple(given.get("mistakes", ()))
    return Exercise(head["name"], head["number"], About(**given), text, parts)


def solved(notebook: Notebook) -> Notebook:
    """The notebook with the code of its solutions in the place of the empty answers."""
    notebook = deepcopy(notebook)
    for one in exercises(notebook):
        for cell, code in zip(one.parts["answer"], one.answers, strict=True):
            cell.metadata.setdefault(OURS, {})[OPEN] = cell.source
            cell.source = code
    return notebook


def reopened(notebook: Notebook) -> Notebook:
    """The inverse: empty answers, and checks that say nothing."""
    notebook = deepcopy(notebook)
    for one in exercises(notebook):
        for cell in one.parts["answer"]:
            cell.source = cell.metadata.get(OURS, {}).pop(OPEN, cell.source)
            if not cell.metadata.get(OURS, True):
                del cell.metadata[OURS]
        for cell in one.parts["answer"] + one.parts["check"]:
            cell.outputs = []
    return notebook
