"""The least value of a function on a box, by grids that shrink."""

from collections.abc import Callable
from functools import cache
from itertools import product

import numpy as np

from nmpcrl import Matrix, Vector

FIRST, NEXT = 15, 5  # points a side of the grids
ROUNDS = 4  # of the grids after the first; the last has a spacing of 1/112 of the box's half width


def minimiser(values: Callable[[Matrix], Vector], lower: Vector, upper: Vector) -> Vector:
    """The point of a box in which a function is least.

    A grid covers the box; each further one covers the cells around the best point so far.

    Args:
        values: of many points at once, shape (points, m).
        lower: the box's least corner, shape (m,).
        upper: its greatest.
    """
    best, half = (lower + upper) / 2, (upper - lower) / 2
    for side in (FIRST, *[NEXT] * ROUNDS):
        points = np.minimum(np.maximum(best + half * _grid(side, len(best)), lower), upper)
        best = points[values(points).argmin()]
        half = half * (2 / (side - 1))  # the spacing of this grid
    return best


@cache
def _grid(side: int, m: int) -> Matrix:
    """The points of a grid of [-1, 1]^m, shape (side^m, m)."""
    return np.array([*product(np.linspace(-1, 1, side), repeat=m)])
