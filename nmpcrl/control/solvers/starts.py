"""Where a cold solve may begin besides standing still: inputs that are held, and drawn ones."""

from collections.abc import Iterator
from itertools import islice, product

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control.problem import Problem

SHARES = (0.4, 1.0)  # of the bounds near which inputs are held
WIDE = 2.0, 100.0  # distances of a bound from rest at which inputs are held at the bound itself
CORNERS = 8  # of the box of inputs, at most, with each share
MOST = 64  # cold starts that can be asked for
LAST = 4  # starts from drawn inputs, with the first seeds, after everything else


def cold_inputs(of: Problem, horizon: int, count: int) -> list[Matrix]:
    """The inputs of the cold starts that follow the one at rest, each of shape (horizon, m)."""
    return list(islice(_inputs(of, horizon), count))


def random_inputs(of: Problem, seed: int, horizon: int) -> Matrix:
    """Inputs drawn within their bounds, and near 0 where these are wide, shape (horizon, m)."""
    lower, upper = _sides(of)
    return np.random.default_rng(seed).uniform(lower, upper, (horizon, lower.size))


def _inputs(of: Problem, horizon: int) -> Iterator[Matrix]:
    """Each input held near a bound, gently and then fully; then drawn ones.

    A bound beyond 1 counts as 1 unless its distance lies within `WIDE`: a robot that keeps turning
    at pi / 2 finds no way around a wall.
    """
    (lower, upper), nearest = _sides(of), np.clip(0.0, of.lower, of.upper)
    lower = np.where(_wide(nearest - of.lower), of.lower, lower)
    upper = np.where(_wide(of.upper - nearest), of.upper, upper)
    signs = product((True, False), repeat=lower.size)
    corners = [np.where(above, upper, lower) for above in islice(signs, CORNERS)]
    for share in SHARES:
        for corner in corners:
            yield np.tile(np.clip(share * corner, lower, upper), (horizon, 1))
    for seed in range(LAST, LAST + MOST):
        yield random_inputs(of, seed, horizon)


def _wide(distance: Vector) -> NDArray[np.bool_]:
    return (distance >= WIDE[0]) & (distance <= WIDE[1])


def _sides(of: Problem) -> tuple[Vector, Vector]:
    """Bounds at most 1 from the input that is nearest to 0."""
    nearest = np.clip(0.0, of.lower, of.upper)
    return np.maximum(of.lower, nearest - 1.0), np.minimum(of.upper, nearest + 1.0)
