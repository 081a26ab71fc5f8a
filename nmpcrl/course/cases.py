"""Random cases in which each known mistake shows: no answer is right, or another, by chance."""

from collections.abc import Callable, Iterable
from typing import TypeVar

Case = TypeVar("Case")

MOST = 2000  # that are looked through for one in which a mistake shows


def telling(
    draw: Callable[[], Case], times: int, shows: Iterable[Callable[[Case], bool]]
) -> list[Case]:
    """Cases, as many as asked for, and one more for each difference that shows in none of them.

    A mistake that shows in one case of six is in none of twenty once in forty times.

    Args:
        draw: gives a random case.
        times: how many are drawn in any event.
        shows: for each two functions that must be told apart, whether they differ in a case.

    Raises:
        RuntimeError: two do not differ in 2000 cases: they are one, or these are drawn badly.
    """
    cases = [draw() for _ in range(times)]
    for seen in shows:
        if not any(map(seen, cases)):
            more = next(filter(seen, (draw() for _ in range(MOST))), None)
            if more is None:
                raise RuntimeError(f"A known mistake does not show in {MOST} random cases.")
            cases.append(more)
    return cases
