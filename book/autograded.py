"""Marks for grading in a chapter of a course: those of nbgrader, or those of otter.

An answer cell keeps what students are given, and has the solution in a marked region behind it,
which either tool takes out. A check is locked. A project has points that a person gives.
"""

from copy import deepcopy
from typing import Any

from nbformat.v4 import new_raw_cell

from nmpcrl.course.exercises import Exercise, exercises

Cell = Any  # nbformat's
Notebook = Any

SCHEMA = 3  # of nbgrader's metadata
LOCKED = ("setup", "exercises-checks")  # cells without which no check says anything
NBGRADER_CONFIG = """import os
from pathlib import Path

os.environ["NMPCRL_DATA"] = str(Path(__file__).resolve().parent / "data")  # of all assignments
c = get_config()  # noqa: F821
c.CourseDirectory.course_id = "nmpcrl"
c.ClearSolutions.code_stub = {"python": ""}  # the dots, or the bug, stand above the solution
c.ExecutePreprocessor.timeout = 120  # [s] of one cell
"""


def for_nbgrader(source: Notebook) -> Notebook:
    """A chapter with solutions in the metadata and regions that nbgrader reads."""
    notebook = deepcopy(source)
    for cell in notebook.cells:
        if cell.id in LOCKED:
            _mark(cell, locked=True)
    for one in exercises(notebook):
        for cell, code in zip(one.parts["answer"], one.answers, strict=True):
            cell.source = f"{cell.source}\n### BEGIN SOLUTION\n{code}\n### END SOLUTION"
            _mark(cell, solution=True)
        for cell in one.parts["given"]:
            _mark(cell, locked=True)
        for cell, points in _worth(one):
            _mark(cell, locked=True, grade=True, points=points)
        for cell in one.parts["rubric"]:
            scheme = "\n".join(solution.source for solution in one.parts["solution"])
            marks = ("=== BEGIN MARK SCHEME ===", scheme, "=== END MARK SCHEME ===")
            cell.source = "\n\n".join([cell.source, *marks])
            _mark(cell, locked=True, task=True, points=one.about.points)
    return _without_solutions(notebook)


def _worth(one: Exercise) -> list[tuple[Cell, int]]:
    """The checks of an exercise, and the points: all of them are the first one's."""
    checks = one.parts["check"]
    return [(cell, 0 if cell is not checks[0] else one.about.worth) for cell in checks]


def _mark(cell: Cell, *, points: int | None = None, **kind: bool) -> None:
    """Write what nbgrader is to do with a cell, which nobody may change where it is locked."""
    marks: dict[str, Any] = dict.fromkeys(("grade", "locked", "solution", "task"), False)
    marks |= kind | {"schema_version": SCHEMA, "grade_id": cell.id, "cell_type": cell.cell_type}
    cell.metadata["nbgrader"] = marks | ({} if points is None else {"points": points})
    if kind.get("locked"):
        cell.metadata |= {"editable": False, "deletable": False}


def for_otter(source: Notebook) -> Notebook:
    """A chapter with solutions between the raw cells that `otter assign` reads."""
    notebook = deepcopy(source)
    for one in exercises(notebook):
        if not one.parts["answer"]:  # a project
            continue
        for cell, code in zip(one.parts["answer"], one.answers, strict=True):
            region = f"# BEGIN SOLUTION NO PROMPT\n{code}\n# END SOLUTION"
            cell.source = f"{cell.source}\n{region}"
        for cell in one.parts["check"]:
            cell.source = f"_ = {cell.source}"  # a test of otter's compares what is shown
        _enclose(notebook, one)
    start = new_raw_cell("# ASSIGNMENT CONFIG\ninit_cell: false\nexport_cell: false", id="otter")
    notebook.cells.insert(0, start)
    return _without_solutions(notebook)


def _enclose(notebook: Notebook, one: Exercise) -> None:
    """Put the raw cells of otter around a question, its answers and its tests."""
    about = f"name: {one.name}\npoints: {one.about.worth}"
    around = {
        "QUESTION": (one.text, one.parts["check"][-1], f"\n{about}"),
        "SOLUTION": (one.parts["answer"][0], one.parts["answer"][-1], ""),
        "TESTS": (one.parts["check"][0], one.parts["check"][-1], ""),
    }
    for word, (first, last, more) in around.items():
        name = f"{one.text.id}-{word.lower()}"
        cells = notebook.cells
        cells.insert(cells.index(first), new_raw_cell(f"# BEGIN {word}{more}", id=f"{name}-begin"))
        cells.insert(cells.index(last) + 1, new_raw_cell(f"# END {word}", id=f"{name}-end"))


def _without_solutions(notebook: Notebook) -> Notebook:
    """The notebook without cells that show a solution to whoever opens it."""
    shown = {"solution", "note"}
    notebook.cells = [
        cell for cell in notebook.cells if not shown & set(cell.metadata.get("tags", []))
    ]
    return notebook
