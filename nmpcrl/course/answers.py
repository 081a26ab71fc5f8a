"""Answers that can be typed: a number, a choice, a formula. The page checks them, too."""

import re
from collections.abc import Callable, Mapping
from math import isfinite, log10
from typing import Any

import numpy as np

from nmpcrl.course.cases import telling
from nmpcrl.course.formulas import FormulaError, evaluated
from nmpcrl.course.outcome import Outcome, Unsolved, refuse_unanswered
from nmpcrl.study.parameters import shortened

THOUSANDS = re.compile(r"(?<!\b0),(?=\d{3}(?!\d))")
CASES = 8  # at which a formula is compared
CLOSE = 1e-6  # relative, of two formulas


def number(
    answer: Any,
    expected: float,
    *,
    tolerance: float = 0.005,
    unit: str = "",
    mistakes: Mapping[float, str] | None = None,
) -> Outcome:
    """A number, right within a tolerance.

    Args:
        answer: the reader's; `...` if there is none.
        expected: the right one, computed from the problem.
        tolerance: relative; absolute if 0 is expected.
        unit: as it stands behind the number.
        mistakes: wrong numbers that are likely, each with what to say.

    Raises:
        Unsolved: it is missing, no number, or wrong.
    """
    refuse_unanswered(answer)
    read = _meanings(answer, unit)
    within = tolerance * (abs(expected) or 1)
    value = next((one for one in read if abs(one - expected) <= within), read[0])
    said = f"Right: {expected:.4g}{unit and ' '}{unit}."
    if abs(value - expected) <= within:
        known = [[float(wrong), why] for wrong, why in (mistakes or {}).items()]
        about = {"expected": float(expected), "within": within, "unit": unit}
        return Outcome(said, {"kind": "number", "said": said, "mistakes": known} | about)
    for wrong, why in (mistakes or {}).items():
        if abs(value - wrong) <= tolerance * (abs(wrong) or 1):
            raise Unsolved(why)
    raise Unsolved(f"{value:g}{unit and ' '}{unit} is not right: {_direction(value, expected)}.")


def _meanings(answer: Any, unit: str) -> list[float]:
    """What a number can mean; as a text, 2,600 is read with either comma, and 20 % is 0.2."""
    try:
        if not isinstance(answer, str):
            return [float(answer)]
        text = answer.strip()
        text = text.removesuffix(unit).strip() if unit else text
        share, text = text.endswith("%"), text.removesuffix("%")
        texts = dict.fromkeys([text.replace(",", ".", 1), THOUSANDS.sub("", text)])
        read = [evaluated(one, {}) for one in texts if "," not in one]
        if not read:
            raise FormulaError("it has too many commas")
        return [one / 100 for one in read] if share else read
    except (TypeError, ValueError):
        raise Unsolved(f"{shortened(repr(answer))} is no number.") from None


def _direction(value: float, expected: float) -> str:
    """What is wrong with a number, of which no mistake is known."""
    if not isfinite(value):
        return "a finite number is asked for"
    if value * expected < 0:
        return "look at the sign"
    if value * expected > 0 and abs(ten := log10(value / expected)) > 0.5 and _near_whole(ten):
        return f"it is {'too large' if ten > 0 else 'too small'} by a power of ten"
    return "it is too large" if abs(value) > abs(expected) else "it is too small"


def _near_whole(value: float) -> bool:
    """Whether a logarithm is that of a power of ten, nearly."""
    return abs(value - round(value)) < 0.005


def choice(answer: Any, right: str, why: Mapping[str, str]) -> Outcome:
    """One letter of several.

    Args:
        answer: the reader's; `...` if there is none.
        right: the letter.
        why: each letter with what to say of it.

    Raises:
        Unsolved: it is missing, no letter of these, or wrong.
    """
    refuse_unanswered(answer)
    letter = answer.strip().lower() if type(answer) is str else ""
    if letter not in why:
        *most, last = why
        raise Unsolved(f"{answer!r} is none of {', '.join(most)} and {last}.")
    if letter != right:
        raise Unsolved(why[letter])
    said = f"Right: {why[right]}"
    return Outcome(said, {"kind": "choice", "said": said, "right": right, "why": dict(why)})


def formula(
    answer: Any,
    expected: Callable[..., float],
    variables: Mapping[str, tuple[float, float]],
    *,
    mistakes: Mapping[str, Callable[..., float]] | None = None,
) -> Outcome:
    """A formula as a text, such as "2 * gamma - 1", compared at random values of its variables.

    Args:
        answer: the reader's; `...` if there is none.
        expected: the right one, a function of the variables by name.
        variables: each with the range from which its values are drawn.
        mistakes: what to say, each with the wrong formula of which to say it.

    Raises:
        Unsolved: it is missing, no formula of these variables, or wrong.
    """
    refuse_unanswered(answer)
    if type(answer) is not str:
        raise Unsolved(f"Write the formula as a text between quotes, of {', '.join(variables)}.")
    known = mistakes or {}
    cases = _cases(np.random.default_rng(), variables, expected, known)
    try:
        values = [evaluated(answer, case) for case in cases]
    except FormulaError as error:
        raise Unsolved(f"{answer!r} is no formula of {', '.join(variables)}: {error}.") from None
    for why, wrong in known.items():
        if _same(values, wrong, cases):
            raise Unsolved(why)
    if not _same(values, expected, cases):
        case = ", ".join(f"{name} = {value:g}" for name, value in cases[0].items())
        raise Unsolved(f"It is not right: for {case} it gives {values[0]:.4g}.")
    return Outcome("Right.", _formula_of_page(expected, variables, known))


def _cases(
    rng: np.random.Generator,
    variables: Mapping[str, tuple[float, float]],
    expected: Callable[..., float],
    mistakes: Mapping[str, Callable[..., float]],
) -> list[dict[str, float]]:
    def draw() -> dict[str, float]:
        return {name: float(rng.uniform(*bounds)) for name, bounds in variables.items()}

    def shows(wrong: Callable[..., float]) -> Callable[[dict[str, float]], bool]:
        return lambda case: not _same([wrong(**case)], expected, [case])

    return telling(draw, CASES, map(shows, mistakes.values()))


def _same(values: list[float], of: Callable[..., float], cases: list[dict[str, float]]) -> bool:
    return bool(np.allclose(values, [of(**case) for case in cases], rtol=CLOSE, atol=1e-12))


def _formula_of_page(
    expected: Callable[..., float],
    variables: Mapping[str, tuple[float, float]],
    mistakes: Mapping[str, Callable[..., float]],
) -> dict[str, Any]:
    """Values at cases that are the same in every build; the formula itself is not there."""
    cases = _cases(np.random.default_rng(0), variables, expected, mistakes)
    values = [float(expected(**case)) for case in cases]
    known = [[[float(wrong(**case)) for case in cases], why] for why, wrong in mistakes.items()]
    about = {"cases": cases, "values": values, "mistakes": known}
    return {"kind": "formula", "said": "Right.", "variables": list(variables)} | about
