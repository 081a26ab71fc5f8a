"""Answers that are code: a function is judged by what it does with fresh random inputs."""

from collections.abc import Callable, Mapping
from copy import deepcopy
from itertools import combinations, starmap
from typing import Any

import numpy as np

from nmpcrl.course.cases import telling
from nmpcrl.course.outcome import Outcome, Unsolved, refuse_unanswered

Arguments = dict[str, Any]  # of one call, by name
Draw = Callable[[np.random.Generator], Arguments]
TIMES = 20  # cases that are drawn


def function(
    answer: Any,
    expected: Callable[..., Any],
    draw: Draw,
    *,
    tolerance: float = 1e-8,
    mistakes: Mapping[str, Callable[..., Any]] | None = None,
) -> Outcome:
    """A function that does the same as another one.

    Args:
        answer: the reader's; one that still returns `...` is not answered yet.
        expected: a function that is right.
        draw: makes the arguments of a call, by name, from a random generator.
        tolerance: relative, and absolute, too.
        mistakes: what to say, each with the wrong function of which to say it.

    Raises:
        Unsolved: it fails, or gives something else in one of the cases.
    """
    refuse_unanswered(answer)
    if not callable(answer):
        raise Unsolved(f"A function is asked for, not {answer!r}.")
    rng, known = np.random.default_rng(), dict(mistakes or {})

    def differ(one: Callable[..., Any], other: Callable[..., Any]) -> Callable[[Arguments], bool]:
        return lambda case: not agree(one(**deepcopy(case)), other(**deepcopy(case)), tolerance)

    pairs = combinations([expected, *known.values()], 2)  # so that each mistake has its sentence
    cases = telling(lambda: draw(rng), TIMES, starmap(differ, pairs))
    values = [_called(answer, case) for case in cases]
    refuse_unanswered(values[0])
    different = [
        (case, value)
        for case, value in zip(cases, values, strict=True)
        if not agree(value, expected(**deepcopy(case)), tolerance)
    ]
    if not different:
        return Outcome(f"Right: it does what it should in {len(cases)} random cases.")
    for why, wrong in known.items():
        theirs = [wrong(**deepcopy(case)) for case in cases]
        if all(agree(*pair, tolerance) for pair in zip(values, theirs, strict=True)):
            raise Unsolved(why)
    case, value = different[0]
    right = expected(**deepcopy(case))
    raise Unsolved(
        f"It is wrong in {len(different)} of {len(cases)} random cases: "
        f"{described(case)}it gives {brief(value)}, and {brief(right)} is right."
    )


def behaves(
    answer: Any, seen: Callable[..., Mapping[str, Any]], draw: Draw, times: int = TIMES
) -> Outcome:
    """A function that need not give what another one does, but of which several things hold.

    Args:
        answer: the reader's; one that returns `...` is not answered yet.
        seen: calls its first argument, the answer, with what was drawn; gives what must hold, each
            by the sentence that is said where it does not.
        draw: as `function` takes it.
        times: how many cases are drawn.

    Raises:
        Unsolved: it fails, or something does not hold in one of the cases.
    """
    refuse_unanswered(answer)
    if not callable(answer):
        raise Unsolved(f"A function is asked for, not {answer!r}.")

    def asked(*args: Any, **kwargs: Any) -> Any:
        value = answer(*args, **kwargs)
        refuse_unanswered(value)
        return value

    rng = np.random.default_rng()
    for case in [draw(rng) for _ in range(times)]:
        try:
            found = seen(asked, **deepcopy(case))
        except Unsolved:
            raise
        except Exception as error:
            raise Unsolved(f"It fails with {type(error).__name__}: {error}") from None
        for why, truth in found.items():
            holds(truth, why)
    return Outcome(f"Right: it does what it should in {times} random cases.")


def _called(answer: Callable[..., Any], case: Arguments) -> Any:
    """What the reader's function gives, which may change its own copy of the arguments."""
    try:
        return answer(**deepcopy(case))
    except Exception as error:
        raise Unsolved(f"It fails {described(case)}with {type(error).__name__}: {error}") from None


def agree(value: Any, other: Any, tolerance: float) -> bool:
    """Whether two results are the same: numbers, arrays, or tuples of them.

    Of what is no number the type must be the same, too: an answer's own type could be equal to
    everything.
    """
    if isinstance(other, tuple):
        alike = isinstance(value, tuple | list) and len(value) == len(other)
        pairs = zip(value, other, strict=True) if alike else ()
        return alike and all(agree(one, two, tolerance) for one, two in pairs)
    try:
        one, two = np.asarray(value, float), np.asarray(other, float)
    except (TypeError, ValueError):
        return type(value) is type(other) and bool(other == value)
    return one.shape == two.shape and np.allclose(one, two, tolerance, tolerance, equal_nan=True)


def holds(truth: Any, why: str) -> None:
    """Refuse an answer that lacks a property.

    Raises:
        Unsolved: with the sentence.
    """
    if not np.all(truth):
        raise Unsolved(why)


def described(case: Arguments) -> str:
    """The arguments that can be shown in a sentence, with which it begins."""
    shown = {name: brief(value) for name, value in case.items()}
    listed = ", ".join(f"{name} = {value}" for name, value in shown.items() if len(value) < 80)
    return f"for {listed} " if listed else ""


def brief(value: Any) -> str:
    """A value with four digits, in one line."""
    if isinstance(value, float | np.ndarray | list) and not isinstance(value, str):
        try:
            text = np.array2string(np.asarray(value, float), precision=4, separator=", ")
        except (TypeError, ValueError):
            text = repr(value)
    else:
        text = repr(value)
    return " ".join(text.split())
