"""Exercises on the pages: a place to type an answer, and what checks it there.

An executed chapter has solved its exercises, and each check has displayed what the page needs to
check the same answer (`nmpcrl.course.outcome.MIME`). The page shows the empty answer, the solution
in a fold and, where an answer can be typed, a hidden place that `book/_static/exercises.js` makes
usable; without scripts and on paper there are the question, its code and the folded solution.
"""

import json
from typing import Any

from nbformat.v4 import new_markdown_cell

from nmpcrl.course.exercises import Exercise, clear_solutions, exercises
from nmpcrl.course.outcome import MIME

PLACE = (
    '<div class="answer" data-exercise="{name}" data-number="{number}" hidden>'
    '<script type="application/json">{data}</script></div>'
)
END = "\n\n</details>"  # of a solution


def placed(notebook: Any) -> Any:
    """An executed notebook with empty answers and, below each that can be typed, its place."""
    every = list(exercises(notebook))
    known = {one.name: _checked(one) for one in every}
    for one in every:
        for cell in one.parts["solution"]:
            code = f"\n\n```python\n{one.solution}\n```{END}"
            cell.source = cell.source.removesuffix(END) + code
    opened(notebook)
    for one in every:
        _join(notebook, one, known[one.name])
    return notebook


def opened(notebook: Any) -> Any:
    """A notebook with empty answers, and checks that say nothing."""
    for one in exercises(notebook):
        for cell in one.parts["answer"] + one.parts["check"]:
            cell.outputs = []
    clear_solutions(notebook)
    return notebook


def _checked(exercise: Exercise) -> dict[str, Any] | None:
    """What the check of an exercise displayed for the page."""
    shown = (out.get("data", {}) for cell in exercise.parts["check"] for out in cell.outputs)
    return next((data[MIME] for data in shown if MIME in data), None)


def _join(notebook: Any, exercise: Exercise, known: dict[str, Any] | None) -> None:
    """Answer and check become one cell, folded where the answer can be typed."""
    *others, last = exercise.parts["answer"] + exercise.parts["check"]
    last.source = "\n\n".join(cell.source for cell in [*others, last])
    dropped = {cell.id for cell in others}
    notebook.cells = [cell for cell in notebook.cells if cell.id not in dropped]
    if known is None:
        return
    last.metadata["tags"] = [*last.metadata.get("tags", []), "hide-input"]
    data = json.dumps(known, ensure_ascii=False).replace("<", "\\u003c")
    place = PLACE.format(name=exercise.name, number=exercise.number, data=data)
    notebook.cells.insert(
        notebook.cells.index(last), new_markdown_cell(place, id=f"{last.id}-page")
    )
