"""Answers that can be typed: a number or a choice. The page checks them, too."""

from collections.abc import Mapping
from math import isfinite, log10
from typing import Any

from nmpcrl.course.outcome import Outcome, Unsolved, refuse_unanswered
from nmpcrl.study.parameters import shortened


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
        mistakes: likely wrong numbers, each with the sentence that explains it.

    Raises:
        Unsolved: the answer is missing, no number, or wrong.
    """
    refuse_unanswered(answer)
    try:
        value = float(answer)
    except (TypeError, ValueError):
        raise Unsolved(f"{shortened(repr(answer))} is not a number.") from None
    known = {float(wrong): why for wrong, why in (mistakes or {}).items()}
    within = tolerance * (abs(expected) or 1)
    behind = f"{unit and ' '}{unit}"
    if abs(value - expected) <= within:
        said = f"Right: {expected:.4g}{behind}."
        about = {"kind": "number", "expected": float(expected), "within": within, "unit": unit}
        return Outcome(said, about | {"said": said, "mistakes": list(map(list, known.items()))})
    for wrong, why in known.items():
        if abs(value - wrong) <= tolerance * (abs(wrong) or 1):
            raise Unsolved(why)
    raise Unsolved(f"{value:g}{behind} is not right: {_direction(value, expected)}.")


def _direction(value: float, expected: float) -> str:
    """What is wrong with a number that is no known mistake."""
    if not isfinite(value):
        return "a finite number is asked for"
    if value * expected < 0:
        return "look at the sign"
    ten = log10(value / expected) if value * expected > 0 else 0.0
    if abs(ten) > 0.5 and abs(ten - round(ten)) < 0.005:
        return f"it is {'too large' if ten > 0 else 'too small'} by a power of ten"
    return "it is too large" if abs(value) > abs(expected) else "it is too small"


def choice(answer: Any, right: str, why: Mapping[str, str]) -> Outcome:
    """One letter of several.

    Args:
        answer: the reader's; `...` if there is none.
        right: the letter.
        why: the sentence that explains each letter.

    Raises:
        Unsolved: the answer is missing, none of these letters, or wrong.
    """
    refuse_unanswered(answer)
    letter = answer.strip().lower() if isinstance(answer, str) else ""
    if letter not in why:
        *most, last = why
        raise Unsolved(f"{shortened(repr(answer))} is none of {', '.join(most)} and {last}.")
    if letter != right:
        raise Unsolved(why[letter])
    said = f"Right: {why[right]}"
    return Outcome(said, {"kind": "choice", "said": said, "right": right, "why": dict(why)})
