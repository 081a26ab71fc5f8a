"""The parameters of a chapter, checked in its second cell."""

import ast
import sys
from difflib import get_close_matches
from typing import Any

import numpy as np

from nmpcrl.study import paper
from nmpcrl.study.design import AXES, FIELDS
from nmpcrl.study.limits import afford as afford
from nmpcrl.study.parameters import ParameterError, one_of, several, shown

INJECTED = "# Parameters\n"  # first line of the cell that papermill adds
ALLOWED = FIELDS | AXES | {"layouts": several(one_of(paper.LAYOUTS), "layout")}
# Step sizes with which a chapter has something to show: with larger ones a run ends at once.
MOST = {"alpha": 1e-5, "beta": 1e-4}  # 100 and 10,000 times the paper's


def check(**declared: Any) -> None:
    """Refuse a value that is not allowed, and a name that the chapter does not declare.

    The second cell calls `check(seeds=seeds, layout=layout)`. Fields of `Experiment` and their
    plurals are checked here, other parameters where they are used.
    """
    for name in sorted(_injected() - set(declared)):
        close = get_close_matches(name, declared, n=1)
        meant = f" (did you mean {close[0]!r}?)" if close else ""
        raise ParameterError(
            f"this chapter has no parameter {name!r}{meant}; it has {', '.join(declared) or 'none'}"
        )
    for name, value in declared.items():
        if name in ALLOWED:
            ALLOWED[name].check(name, value)
        if name == "layout":
            _refuse_place(value)
        if name in MOST and value > MOST[name]:
            raise ParameterError(
                f"{name} = {value:g} must be at most {MOST[name]:g} in a chapter: with larger ones"
                " a run ends before there is anything to show"
            )


def _refuse_place(layout: Any) -> None:
    """Refuse an obstacle on the robot's start or target, or outside the robot's box."""
    task, centres = paper.task(layout), np.array(paper.centres_of(layout))
    (left, bottom, _), (right, top, _) = task.lower, task.upper
    outside = np.any((centres < (left, bottom)) | (centres > (right, top)))
    if outside or task.overlap(np.array([task.start, task.target])).max() > 0:
        start, target = (f"({x:g}, {y:g})" for x, y, _ in (task.start, task.target))
        raise ParameterError(
            f"layout = {shown(layout)} must, in a chapter, have each centre in the robot's box,"
            f" [{left:g}, {right:g}] x [{bottom:g}, {top:g}], and {max(task.discs[2]) / 2:g} m or"
            f" more away from the robot's start, {start}, and target, {target}"
        )


def _injected() -> set[str]:
    """The names that papermill set in this session; none outside a notebook."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    cells = shell.history_manager.input_hist_raw if shell else []
    *_, latest = ["", *(cell for cell in cells if cell.startswith(INJECTED))]
    assigned = (node for node in ast.walk(ast.parse(latest)) if isinstance(node, ast.Assign))
    names = {one.id for node in assigned for one in node.targets if isinstance(one, ast.Name)}
    return {name for name in names if not name.startswith(("_", "PAPERMILL_"))}  # its own
