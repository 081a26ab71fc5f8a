"""What a student hands in, put into the chapter: answers and own cells are theirs, the rest ours.

A chapter comes from the edition for graders, of which the solutions are taken out. So it does not
matter if a check, a parameter or any other cell of it was edited or deleted.
"""

import json
import re
from collections import defaultdict
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from symtable import symtable
from typing import Any

from nmpcrl.course.exercises import HEAD, Cell, Exercise, Notebook, exercises
from nmpcrl.study.refusal import Refusal

SOLUTION = re.compile(r"\n### BEGIN SOLUTION\n.*?\n### END SOLUTION", flags=re.S)


class CannotGrade(Refusal):
    """A file is no notebook, or a folder no edition for graders; the message says which."""


class Fields(dict[str, Any]):
    """A JSON object whose fields are attributes, as those of nbformat are."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None


@dataclass(frozen=True, eq=False)
class Chapter:
    """A chapter of the edition for graders."""

    name: str  # of its file, without its ending
    notebook: Notebook  # without solutions
    exercises: list[Exercise]
    data: Path | None = None  # the folder of what it reads

    @cached_property
    def blanks(self) -> dict[str, str]:
        """The code of the untouched answer cells, by their names."""
        return {c.id: c.source for one in self.exercises for c in one.parts["answer"]}

    @cached_property
    def asked(self) -> set[str]:
        """The names that answers bind."""
        return set().union(*(_names_in(code, bound=True) for code in self.blanks.values()))


@dataclass(frozen=True, eq=False)
class Step:
    """A code cell to execute."""

    name: str
    code: str
    group: str = ""  # its exercise; the cell alone if a student added it elsewhere; else empty
    theirs: bool = False  # a student wrote it
    check: bool = False  # it is not for the notebook's process, but for the judge's
    answers: tuple[str, ...] = ()  # the names of answers that a check takes


@dataclass(frozen=True, eq=False)
class Submission:
    """The code cells in their order, and what is to be said of an exercise in any case."""

    steps: list[Step]
    remarks: dict[str, str] = field(default_factory=dict)  # by the name of an exercise


def _names_in(code: str, *, bound: bool = False) -> set[str]:
    """The names in a code, or those that it binds."""
    symbols = symtable(code, "<cell>", "exec").get_symbols()
    return {one.get_name() for one in symbols if one.is_assigned() or not bound}


def notebook_of(path: Path) -> Notebook:
    """A notebook from its file, whoever wrote it.

    Raises:
        CannotGrade: it is none.
    """
    try:
        notebook = json.loads(path.read_text("utf-8-sig"), object_hook=Fields)
        for cell in notebook["cells"]:
            source = cell["source"]
            cell["source"] = source if isinstance(source, str) else "".join(source)
            cell["metadata"] = Fields(cell.get("metadata") or {})
            tags = cell["metadata"].get("tags")
            cell["metadata"]["tags"] = tags if isinstance(tags, list) else []
            marks = cell["metadata"].get("nbgrader")
            cell["metadata"]["nbgrader"] = marks if isinstance(marks, dict) else {}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise CannotGrade("The file is no notebook.") from None
    return notebook


def chapters(edition: Path) -> list[Chapter]:
    """The chapters of an edition for graders, each an assignment in nbgrader's folder `source`.

    Raises:
        CannotGrade: the folder has none.
    """
    found = []
    for path in sorted((edition / "source").glob("*/*.ipynb")):
        notebook = notebook_of(path)
        for cell in notebook.cells:
            cell["source"] = SOLUTION.sub("", cell["source"])
        data = edition / "data"
        every = list(exercises(notebook))
        if any(c.metadata.nbgrader for one in every for c in one.parts["check"]):
            found.append(Chapter(path.stem, notebook, every, data if data.is_dir() else None))
    if not found:
        raise CannotGrade(f"{edition} has no edition for graders; `make course` writes it")
    return found


def matched(chapter: Chapter, notebook: Notebook) -> Submission:
    """A student's answers and own cells in a chapter."""
    answers, added = _theirs(chapter, notebook)
    owner = {cell.id: one for one in chapter.exercises for cell in _cells(one)}
    steps, remarks = [_added(cell, "") for cell in added[""]], {}
    for cell in chapter.notebook.cells:
        one = owner.get(cell.id)
        name = one.name if one else ""
        if cell.cell_type == "code":
            code, theirs = answers.get(cell.id, cell.source), cell.id in chapter.blanks
            if theirs and cell.id not in answers:
                remarks[name] = "The answer cell is missing."
            check = one is not None and cell in one.parts["check"]
            taken = tuple(sorted(chapter.asked & _names_in(code))) if check else ()
            steps.append(Step(cell.id, code, name, theirs, check, taken))
        steps += [_added(one_more, name) for one_more in added[cell.id]]
    return Submission(steps, remarks)


def _added(cell: Cell, exercise: str) -> Step:
    name = f"theirs-{id(cell)}"
    return Step(name, cell["source"], exercise or name, theirs=True)


def _cells(one: Exercise) -> list[Cell]:
    return [one.text, *(cell for cells in one.parts.values() for cell in cells)]


def _theirs(chapter: Chapter, notebook: Notebook) -> tuple[dict[str, str], dict[str, list[Cell]]]:
    """Answers by the cell's name in the chapter, and added cells by that which they follow."""
    ours = {cell.id: cell.source for cell in chapter.notebook.cells}
    answers: dict[str, str] = {}
    added: dict[str, list[Cell]] = defaultdict(list)
    last = ""
    for cell, name in zip(notebook.cells, _names(chapter, notebook), strict=True):
        if name in ours and not (name in answers and name in chapter.blanks):
            last = name
            if name in chapter.blanks and cell.get("cell_type") == "code":
                answers[name] = cell.source
        elif cell.get("cell_type") == "code" and not _copied(cell, set(ours.values())):
            added[last].append(cell)
    return answers, added


def _copied(cell: Cell, ours: set[str]) -> bool:
    """Whether an added cell is one of the chapter, or claims to be a check."""
    return cell.source in ours or "check" in cell.metadata["tags"]


def _names(chapter: Chapter, notebook: Notebook) -> list[str]:
    """The name of each cell: nbgrader's, its own, or that of the answer which it must be."""
    answers = {one.name: [cell.id for cell in one.parts["answer"]] for one in chapter.exercises}
    known = {cell.id for cell in chapter.notebook.cells}
    names, left = [], list[str]()
    for cell in notebook.cells:
        head = HEAD.match(cell.source)
        if head:
            left = list(answers.get(head["name"], []))
        name = str(cell.metadata.nbgrader.get("grade_id") or cell.get("id") or "")
        if name not in known and "answer" in cell.metadata["tags"] and left:
            name = left[0]
        left = [one for one in left if one != name]
        names.append(name)
    return names
