"""What a chapter is given: its parameters, checked before anything else is done with them."""

import ast
import sys
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.limits import estimate
from nmpcrl.study.parameters import ParameterError, one_of, several, shown
from nmpcrl.study.sweeps import AXES, FIELDS

INJECTED = "# Parameters\n"  # so begins the cell in which papermill sets what it is given
OF_PAPERMILL = "PAPERMILL_"  # so begin the names that it sets on its own account
NAMED = several(one_of(paper.LAYOUTS), "layout")  # of which a study is published
# Step sizes with which a chapter has something to show: with larger ones a run ends at once.
MOST = {"alpha": 1e-5, "beta": 1e-4}  # 100 and 10,000 times the paper's


def check(**declared: Any) -> None:
    """Refuse a value that is not what it may be, and a name that the chapter does not declare.

    `check(seeds=seeds, layout=layout)` stands in the second cell. A parameter that is a field of
    `Experiment`, or the plural of one, is checked here, and any other one where it is used.
    Papermill sets whatever name it is given, so a misspelt one would change nothing.

    Raises:
        ParameterError: in one sentence.
    """
    for name in sorted(_injected() - set(declared)):
        close = get_close_matches(name, declared, n=1)
        meant = f" (did you mean {close[0]!r}?)" if close else ""
        raise ParameterError(
            f"this chapter has no parameter {name!r}{meant}; it has {', '.join(declared) or 'none'}"
        )
    for name, value in declared.items():
        allowed = (FIELDS | AXES | {"layouts": NAMED}).get(name)
        if allowed:
            allowed.check(name, value)
        if name == "layout":
            _placed(value)
        if name in MOST and value > MOST[name]:
            raise ParameterError(
                f"{name} = {value:g} must be at most {MOST[name]:g} in a chapter: with larger ones"
                " a run ends before there is anything to show"
            )


def afford(experiments: Iterable[Experiment]) -> None:
    """Refuse runs that take too long or too much memory, as `Estimate.refuse` does.

    Raises:
        ParameterError: in one sentence, which says how to train them nevertheless.
    """
    estimate(experiments).refuse()


def _placed(layout: Any) -> None:
    """Refuse an obstacle on the robot's start or target, or where the robot never comes."""
    task = paper.task(layout)
    for end, place in (("start", task.start), ("target", task.target)):
        if task.overlap(place).max() > 0:
            raise ParameterError(
                f"layout = {shown(layout)} has an obstacle on the robot's {end},"
                f" ({place[0]:g}, {place[1]:g}): each centre must be"
                f" {max(task.discs[2]) / 2:g} m or more away from it in a chapter"
            )
    (left, bottom, _), (right, top, _) = task.lower, task.upper
    for x, y in paper.centres_of(layout):
        if not (left <= x <= right and bottom <= y <= top):
            raise ParameterError(
                f"layout = {shown(layout)} has an obstacle where the robot never comes,"
                f" ({x:g}, {y:g}): each centre must be in its box,"
                f" [{left:g}, {right:g}] x [{bottom:g}, {top:g}], in a chapter"
            )


def _injected() -> set[str]:
    """The names that papermill set in this session; none where there is no notebook."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    cells = shell.history_manager.input_hist_raw if shell else []
    *_, latest = ["", *(cell for cell in cells if cell.startswith(INJECTED))]
    assigned = (node for node in ast.walk(ast.parse(latest)) if isinstance(node, ast.Assign))
    names = {one.id for node in assigned for one in node.targets if isinstance(one, ast.Name)}
    return {name for name in names if not name.startswith(("_", OF_PAPERMILL))}
