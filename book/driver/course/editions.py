"""Editions of a chapter for a course: its source in, a notebook for students or teachers out.

A source has each solution behind the empty answer, between the marks that nbgrader takes out, so it
is the teacher's edition itself. For nbgrader the cells carry the metadata that it asks for.
"""

import re
from collections.abc import Collection
from copy import deepcopy
from typing import Any

from nmpcrl.course.exercises import clear_solutions, exercises, tags_of

Notebook = Any

QUICK = {"length": '"smoke"', "budget": "200"}  # parameters with which a notebook takes minutes
LINK = re.compile(r"\[(?P<words>[^][]+)\]\((?P<page>[\w.-]+\.(?:ipynb|md))(?:#[\w:-]+)?\)")
ONLY_TEACHERS, ONLY_SLIDES = {"solution", "notes"}, {"slide", "remove-cell"}  # tags
SCHEMA = 3  # of nbgrader's metadata
NBGRADER_CONFIG = """c = get_config()  # noqa: F821
c.CourseDirectory.course_id = "nmpcrl"
c.ClearSolutions.code_stub = {"python": ""}  # the dots, or the bug, stand above the solution
c.ExecutePreprocessor.timeout = 600  # [s] of one cell
"""


def student(source: Notebook, pages: Collection[str]) -> Notebook:
    """A chapter without solutions, as nbgrader releases it; a failing check does not stop it.

    Args:
        source: the chapter.
        pages: the files that lie beside it: links to others become words.
    """
    notebook = for_nbgrader(source, pages)
    clear_solutions(notebook)
    return notebook


def teacher(source: Notebook, pages: Collection[str]) -> Notebook:
    """A chapter with solutions, slides and speaker notes, and with quick parameters."""
    notebook = deepcopy(source)
    for cell in notebook.cells:
        if "parameters" in tags_of(cell):
            for name, value in QUICK.items():
                given = re.compile(rf"^{name} = .*$", flags=re.M)
                cell.source = given.sub(f"{name} = {value}", cell.source)
        if "check" in tags_of(cell):
            cell.metadata["tags"] = [*tags_of(cell), "raises-exception"]
        cell.source = LINK.sub(
            lambda link: link[0] if link["page"] in pages else link["words"], cell.source
        )
    return notebook


def for_nbgrader(source: Notebook, pages: Collection[str]) -> Notebook:
    """A chapter of which nbgrader makes the students' edition and grades it."""
    notebook = _without_solutions(teacher(source, pages))
    for one in exercises(notebook):
        for cell in one.parts["answer"]:
            _mark(cell, solution=True)
        for cell in one.parts["check"]:
            _mark(cell, locked=True, grade=True, points=one.points)
    return notebook


def _without_solutions(notebook: Notebook) -> Notebook:
    """A notebook without the reasoning behind solutions, and without what only slides show."""
    notebook.cells = [
        cell
        for cell in notebook.cells
        if not ONLY_TEACHERS & {*tags_of(cell)} and not {*tags_of(cell)} >= ONLY_SLIDES
    ]
    return notebook


def _mark(cell: Any, **marks: Any) -> None:
    """Write the metadata by which nbgrader knows an answer or a check."""
    about = {"schema_version": SCHEMA, "grade_id": cell.id, "cell_type": cell.cell_type}
    kinds = dict.fromkeys(("grade", "locked", "solution", "task"), False)
    cell.metadata["nbgrader"] = about | kinds | marks
