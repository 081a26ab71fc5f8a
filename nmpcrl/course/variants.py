"""Other numbers in the questions of a chapter, drawn from a secret: published answers do not fit.

A question is varied by replacing one number that it prints, where `outcome.varied` says which and
within what. What cannot be varied so is practice: the words of a choice would give it away, and a
function that is right is right for all inputs.
"""

import ast
import importlib
import re
from copy import deepcopy
from inspect import signature
from typing import Any

import numpy as np

from nmpcrl.course.exercises import HEAD, OURS, Exercise, Notebook, exercises

CHECKS = "exercises-checks"  # the cell that imports them
IMPORT = re.compile(r"^from (nmpcrl\.course\.checks) import (\w+) as check$", flags=re.M)
CALL = re.compile(r"check\.(\w+)\((.*)\)", flags=re.S)
LATER = "# This answer is checked when it is graded."  # in the place of a check, for students


def varied(source: Notebook, secret: bytes) -> Notebook:
    """A chapter in which each exercise has other numbers and counts, or is practice.

    Hints and the words of a solution are left out where its numbers are others.

    Args:
        source: the chapter.
        secret: whatever it holds; the same gives the same numbers.
    """
    notebook = deepcopy(source)
    checks = _checks(notebook)
    for one in exercises(notebook):
        if not one.parts["check"]:
            continue
        (cell,) = one.parts["check"]
        called = CALL.fullmatch(cell.source)
        if called is None:
            raise ValueError(f"exercise {one.number} does not call its check alone")
        check = getattr(checks, called[1])
        numbers = getattr(check, "varied", {})
        one.text.metadata[OURS]["exercise"]["counts"] = bool(numbers)
        for name, within in numbers.items():
            printed = f"{signature(check).parameters[name].default:g}"
            drawn = _drawn(secret, one, within)
            _replace(one, printed, drawn)
            cell.source = f"check.{called[1]}({called[2]}, {name}={drawn})"
        if numbers:
            dropped = {hint.id for hint in one.parts["hint"]}
            notebook.cells = [cell for cell in notebook.cells if cell.id not in dropped]
            one.text.metadata[OURS]["exercise"].pop("mistakes", None)
    return notebook


def withhold(one: Exercise) -> None:
    """Leave out the check of an exercise that counts because of a secret."""
    if "counts" in one.text.metadata[OURS]["exercise"] and one.about.counts:
        for cell in one.parts["check"]:
            cell.source = LATER


def _checks(notebook: Notebook) -> Any:
    """The module of a chapter's checks."""
    code = next(cell.source for cell in notebook.cells if cell.id == CHECKS)
    found = IMPORT.search(code)
    if found is None:
        raise ValueError(f"{code!r} does not import the checks of a chapter")
    return importlib.import_module(".".join(found.groups()))


def values(within: tuple[float, float, float]) -> list[str]:
    """What may be drawn, as it is printed."""
    low, high, step = within
    return [f"{low + k * step:g}" for k in range(round((high - low) / step) + 1)]


def _drawn(secret: bytes, one: Exercise, within: tuple[float, float, float]) -> str:
    rng = np.random.default_rng([*one.number.encode(), 0, *secret])
    return str(rng.choice(values(within)))


def _replace(one: Exercise, printed: str, drawn: str) -> None:
    """Put another number where one is printed: in the question, in the answer and its solution."""
    number = re.compile(rf"(?<![\d.]){re.escape(printed)}(?![\d.]\d|\d)")
    head = HEAD.match(one.text.source)
    begins = head.end() if head else 0
    text = one.text.source[begins:]
    if not number.search(text):
        raise ValueError(f"exercise {one.number} does not print {printed}")
    one.text.source = one.text.source[:begins] + number.sub(drawn, text)
    for cell in one.parts["answer"]:
        cell.source = number.sub(drawn, cell.source)
    codes = [f"```python\n{number.sub(drawn, code)}\n```" for code in one.answers]
    for cell in one.parts["solution"]:
        cell.source = "\n\n".join(codes)


def without(code: str) -> str:
    """The code of a module of checks without those of which a number may be another."""
    functions = [node for node in ast.parse(code).body if isinstance(node, ast.FunctionDef)]
    gone = [node for node in functions if any(map(_is_varied, node.decorator_list))]
    lines = code.splitlines(keepends=True)
    for node in reversed(gone):
        del lines[node.decorator_list[0].lineno - 1 : node.end_lineno]
    return "".join(lines)


def _is_varied(mark: ast.expr) -> bool:
    return isinstance(mark, ast.Call) and ast.unparse(mark.func) == "varied"
