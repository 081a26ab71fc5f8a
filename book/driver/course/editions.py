"""Editions of a chapter for a course: its source in, a notebook for students or teachers out.

Both have a cell that says how to set up and where the data are, a line with kind, level, minutes
and points in each exercise, and parameters with which a notebook takes less than two minutes.
Students get no solutions; teachers get them in the place of the answers, tables with the minutes of
sections and exercises, and a note in each exercise and at each live figure. Graders get one from
which nbgrader, otter or `nmpcrl grade` makes the rest.
"""

import re
from collections.abc import Collection
from copy import deepcopy
from typing import Any

from nbformat.v4 import new_code_cell, new_markdown_cell

from driver.course import autograded
from driver.teaching import syllabus
from driver.teaching.declared import declared
from driver.teaching.plans import LIVE, lecture
from driver.teaching.syllabus import LIVE as LIVE_FIGURE
from driver.teaching.syllabus import Chapter
from nmpcrl.course.exercises import HEAD, Exercise, exercises, solved
from nmpcrl.course.variants import withhold

Notebook = Any

OFFLINE = {"repeat": False, "length": "smoke", "budget": 200}  # parameters of every edition
LINK = re.compile(r"\[(?P<words>[^][]+)\]\((?P<page>[\w.-]+\.(?:ipynb|md))(?:#[\w:-]+)?\)")
ELSEWHERE = re.compile(r"^make .*\n|(?<=^papermill )book/", flags=re.M)  # in a box "Try"
INSTALL = """**Before you begin.** In the folder of these notebooks, once, in a terminal on macOS or
Linux; `README.md` says how on Windows:

```bash
python3 -m venv .venv
.venv/bin/pip install -r requirements.txt
.venv/bin/jupyter lab
```

Put your answers where the dots are, and run the check below each. A check that fails says why in
one sentence; nothing else depends on it. Everything runs without a network, from the folder
`data`."""
SETUP = """import os
from pathlib import Path

data = Path(os.environ.get("NMPCRL_DATA", "data"))
if not (data / "published").is_dir():
    raise FileNotFoundError("There is no folder `data` here: keep it beside the notebooks.")
folders = {"PUBLISHED": "published", "RUNS": "runs", "LIVE": "live"}
os.environ |= {f"NMPCRL_{name}": str(data / folder) for name, folder in folders.items()}
os.environ["NMPCRL_STRICT"] = "1"  # an answer that is missing or wrong fails"""
COLUMNS = "| exercise | kind | level | minutes | points | goal |\n|---|---|---|---|---|---|"
TIMES = "| section | reading | lecture | live figures |\n|---|---:|---:|---:|"


def student(source: Notebook, pages: Collection[str]) -> Notebook:
    """A chapter without answers and solutions; a check that fails does not stop the notebook.

    Args:
        source: the chapter.
        pages: what lies beside the edition: links elsewhere become words.
    """
    notebook = deepcopy(source)
    for one in exercises(notebook):
        _line(one)
        for cell in one.parts["check"]:
            cell.metadata |= {"editable": False, "deletable": False}
            cell.metadata["tags"] = [*cell.metadata["tags"], "raises-exception"]
        withhold(one)
        _drop(notebook, one.parts["solution"])
        one.text.metadata["nmpcrl"]["exercise"].pop("mistakes", None)
    return _edition(notebook, pages)


def teacher(source: Notebook, pages: Collection[str]) -> Notebook:
    """A chapter with solutions, and notes on its exercises; arguments as for `student`."""
    notebook = solved(source)
    every = list(exercises(notebook))
    for one in every:
        _line(one)
        _insert(notebook, notebook.cells.index(one.text) + 1, _note(one), f"{one.text.id}-note")
        for cell in one.parts["answer"]:
            del cell.metadata["nmpcrl"]
    for cell in [cell for cell in notebook.cells if LIVE_FIGURE.search(cell.source)]:
        note = f"> **For the teacher.** {declared().helps(cell.id)}"
        _insert(notebook, notebook.cells.index(cell), note, f"{cell.id}-note")
    if every:
        _insert(notebook, 1, _table(every), "exercises-table")
    _insert(notebook, 1, _times(syllabus.chapter("", 0, source)), "sections-table")
    return _edition(notebook, pages)


def grader(source: Notebook, pages: Collection[str], *, otter: bool = False) -> Notebook:
    """A chapter with marks for nbgrader, or for otter; other arguments as for `student`."""
    notebook = deepcopy(source)
    for one in exercises(notebook):
        _line(one)
        one.text.metadata["nmpcrl"]["exercise"].pop("mistakes", None)
    made = _edition(notebook, pages)
    return autograded.for_otter(made) if otter else autograded.for_nbgrader(made)


def _edition(notebook: Notebook, pages: Collection[str]) -> Notebook:
    """What both have in common."""
    setup = [
        new_markdown_cell(INSTALL, id="setup-text"),
        new_code_cell(SETUP, id="setup"),
    ]
    notebook.cells[1:1] = setup
    for cell in notebook.cells:
        if "parameters" in cell.metadata.get("tags", []):
            cell.source = _offline(cell.source)
        if "try" in cell.metadata.get("tags", []):
            cell.source = ELSEWHERE.sub("", cell.source)
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
        cell.source = LINK.sub(
            lambda link: link[0] if link["page"] in pages else link["words"], cell.source
        )
    return notebook


def _offline(parameters: str) -> str:
    """A cell of parameters with those of OFFLINE."""
    for name, value in OFFLINE.items():
        parameters = re.sub(rf"^{name} = .*$", f"{name} = {value!r}", parameters, flags=re.M)
    return parameters.replace("'", '"')


def _line(exercise: Exercise) -> None:
    """Kind, level, minutes and points behind the number of an exercise."""
    line = rf"\g<0>*{exercise.about.line}*\n\n"
    exercise.text.source = HEAD.sub(line, exercise.text.source)


def _drop(notebook: Notebook, cells: list[Any]) -> None:
    ids = {cell.id for cell in cells}
    notebook.cells = [cell for cell in notebook.cells if cell.id not in ids]


def _insert(notebook: Notebook, index: int, text: str, name: str) -> None:
    note = new_markdown_cell(text, id=name, metadata={"tags": ["note"]})
    notebook.cells.insert(index, note)


def _note(exercise: Exercise) -> str:
    """For whoever teaches: the goal, and what goes wrong."""
    about = exercise.about
    lines = [f"> **For the teacher.** Goal: {about.goal}."]
    lines += [f"> - Common: {mistake}" for mistake in about.mistakes]
    return "\n>\n".join(lines[:2]) + "".join(f"\n{line}" for line in lines[2:])


def _table(every: list[Exercise]) -> str:
    rows = [
        f"| {one.number} | {one.about.kind} | {one.about.level} | {one.about.minutes} "
        f"| {one.about.worth or 'practice'} | {one.about.goal} |"
        for one in every
    ]
    minutes, points = (sum(getattr(o.about, k) for o in every) for k in ("minutes", "worth"))
    total = f"Together {minutes} minutes and {points} points."
    return "\n".join(
        ["**For the teacher: the exercises of this chapter.**\n", COLUMNS, *rows, "", total]
    )


def _times(chapter: Chapter) -> str:
    """The minutes of each section, as the plans of a course count them."""
    rows = [
        f"| {one.title} | {syllabus.minutes([one])} | {lecture([one])} | {LIVE * one.live or ''} |"
        for one in chapter.sections
    ]
    every = chapter.sections
    total = f"| Together | {chapter.reading} | {lecture(every)} "
    total += f"| {LIVE * sum(one.live for one in every) or ''} |"
    title = "**For the teacher: minutes of each section.**\n"
    return "\n".join([title, TIMES, *rows, total])
