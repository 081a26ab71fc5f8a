"""Tables in a model, written down in SX: they compile, as those of `ca.interpolant` do not."""

from typing import Any

import casadi as ca
import numpy as np

from nmpcrl import Vector


def lookup(points: Any, values: Any, x: Any, *, cubic: bool = False) -> ca.SX:
    """A table's value at the symbol `x`: between its points a line or a cubic spline.

    As `ca.interpolant` with "linear" or "bspline" inside the table; beyond it the last piece goes
    on. With that one riccati gives way to fatrop, which takes milliseconds for microseconds. Where
    a plan comes to rest in the kink between two lines, no solver here is sure to end: take a
    spline. Values of a linear table may be symbols, which are then learned.

    Args:
        points: where the table has values, ascending, shape (k,); k is 4 or more if cubic.
        values: shape (k,).
        x: one number.
        cubic: a spline, whose second derivative is continuous, too.

    Raises:
        ValueError: the table is none.
    """
    at = np.array(points, float)
    count = values.numel() if isinstance(values, ca.SX) else np.size(values)
    least = 4 if cubic else 2
    if at.ndim != 1 or at.size < least or not (np.diff(at) > 0).all() or count != at.size:
        raise ValueError(
            f"a table must have {least} ascending points or more and a value for each: it has"
            f" points {points} and {count} values"
        )
    if cubic:
        return _spline(at, np.array(values, float), x)
    column = ca.SX(values)
    found: ca.SX
    slopes = (column[1:] - column[:-1]) / ca.DM(np.diff(at))
    found = column[0] + slopes[0] * (x - at[0])
    for k in range(1, at.size - 1):
        found += (slopes[k] - slopes[k - 1]) * ca.fmax(0, x - at[k])
    return found


def _spline(at: Vector, values: Vector, x: Any) -> ca.SX:
    """The cubic through all points that has no knot in the second and the last but one."""
    from scipy.interpolate import CubicSpline

    cubic, square, slope, value = CubicSpline(at, values).c  # of each piece
    beyond = x - at[0]
    found: ca.SX = value[0] + beyond * (slope[0] + beyond * (square[0] + beyond * cubic[0]))
    for k in range(2, at.size - 2):
        found += (cubic[k] - cubic[k - 1]) * ca.fmax(0, x - at[k]) ** 3
    return found
