"""Where a cold solve may begin besides standing still: inputs that are held, and drawn ones."""

from collections.abc import Iterator
from itertools import islice, product

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.problem import Problem

SHARES = (0.4, 1.0)  # of the bounds near which inputs are held
CORNERS = 8  # of the box of inputs, at most, with each share
MOST = 64  # cold starts that can be asked for


def cold_inputs(of: Problem, horizon: int, count: int) -> list[Matrix]:
    """The inputs of the cold starts that follow the one at rest, each of shape (horizon, m)."""
    return list(islice(_inputs(of, horizon), count))


def random_inputs(of: Problem, seed: int, horizon: int) -> Matrix:
    """Inputs drawn within their bounds, and near 0 where these are wide, shape (horizon, m)."""
    lower, upper = _sides(of)
    return np.random.default_rng(seed).uniform(lower, upper, (horizon, lower.size))


def _inputs(of: Problem, horizon: int) -> Iterator[Matrix]:
    """Each input held near a bound, gently and then fully; then drawn ones."""
    lower, upper = _sides(of)
    signs = product((True, False), repeat=lower.size)
    corners = [np.where(above, upper, lower) for above in islice(signs, CORNERS)]
    for share in SHARES:
        for corner in corners:
            yield np.tile(np.clip(share * corner, lower, upper), (horizon, 1))
    for seed in range(MOST):
        yield random_inputs(of, seed, horizon)


def _sides(of: Problem) -> tuple[Vector, Vector]:
    """Bounds at most 1 from the input that is nearest to 0."""
    nearest = np.clip(0.0, of.lower, of.upper)
    return np.maximum(of.lower, nearest - 1.0), np.minimum(of.upper, nearest + 1.0)
