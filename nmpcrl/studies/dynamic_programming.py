"""The best policy of the plant of `gros_zanon`, by dynamic programming on a grid of states.

Howard's policy iteration interpolates values bilinearly between the points of the grid, and takes
the expectation over e at the midpoints of equal intervals.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.interpolate import RegularGridInterpolator
from scipy.sparse.linalg import spsolve

from nmpcrl import Matrix, Vector
from nmpcrl.study.problems import gros_zanon as gz

LEAST, MOST = np.array([-0.6, -1.2]), np.array([1.4, 1.2])  # corners of the grid
SWEEPS = 100  # of policy iteration, at most
NODES = 8  # midpoints at which the disturbance is taken

Axes = tuple[Vector, Vector]


@dataclass(frozen=True, eq=False)
class Grid:
    """The value and the best input at each point of the grid."""

    axes: Axes
    value: Matrix  # shape (points, points)
    policy: Matrix  # shape (points, points)

    @cached_property
    def _policy(self) -> RegularGridInterpolator:
        return RegularGridInterpolator(self.axes, self.policy, bounds_error=False, fill_value=None)

    def action(self, state: Vector) -> Vector:
        """The input in a state, shape (1,)."""
        inside = np.clip(state, LEAST, MOST)
        found: Vector = np.clip(self._policy(inside), -1, 1)
        return found


def best(points: int, inputs: int) -> Grid:
    """The best policy of the plant.

    Args:
        points: of the grid, along each axis.
        inputs: to choose from in [-1, 1]; a parabola refines the best one.
    """
    axes = (np.linspace(LEAST[0], MOST[0], points), np.linspace(LEAST[1], MOST[1], points))
    states = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    actions = np.linspace(-1, 1, inputs)
    low, high = gz.DISTURBANCE
    e = low + (np.arange(NODES) + 0.5) / NODES * (high - low)
    moves = [_transition(states, a, e, axes) for a in actions]
    costs = np.stack([_costs(states, a) for a in actions])
    chosen, everyone = np.zeros(len(states), int), np.arange(len(states))
    for _ in range(SWEEPS):
        closed = sparse.vstack([moves[k] for k in range(inputs)], format="csr")
        closed = closed[chosen * len(states) + everyone]
        value = spsolve(sparse.eye(len(states), format="csc") - gz.GAMMA * closed.tocsc(),
                        costs[chosen, everyone])  # fmt: skip
        q = costs + gz.GAMMA * np.stack([move @ value for move in moves])
        better = q.argmin(axis=0)
        gained = q[chosen, everyone] - q[better, everyone] > 1e-10
        if not gained.any():
            break
        chosen = np.where(gained, better, chosen)
    shape = (points, points)
    return Grid(axes, value.reshape(shape), _refined(q, actions, chosen).reshape(shape))


def _transition(states: Matrix, action: float, e: Vector, axes: Axes) -> sparse.csr_array:
    """The probability of each successor of each point, by bilinear weights."""
    later = states @ gz.TRUE_A.T + action * gz.TRUE_B[:, 0]
    everyone, points = np.arange(len(states)), len(axes[1])
    rows, columns, weights = [], [], []
    for shift in e:
        (i, s), (j, t) = _cell(later[:, 0] + shift, axes[0]), _cell(later[:, 1], axes[1])
        for di, wi in ((0, 1 - s), (1, s)):
            for dj, wj in ((0, 1 - t), (1, t)):
                rows.append(everyone)
                columns.append((i + di) * points + j + dj)
                weights.append(wi * wj / len(e))
    data, row, column = (np.concatenate(one) for one in (weights, rows, columns))
    return sparse.csr_array((data, (row, column)), shape=(len(states), len(states)))


def _cell(values: Vector, axis: Vector) -> tuple[NDArray[np.int_], Vector]:
    """The index of the point below each value, and the share of the way to the next point."""
    at = np.clip((values - axis[0]) / (axis[1] - axis[0]), 0, len(axis) - 1)
    below = np.minimum(at.astype(int), len(axis) - 2)
    return below, at - below


def _costs(states: Matrix, action: float) -> Vector:
    outside = np.maximum(0, gz.LOWER - states) + np.maximum(0, states - gz.UPPER)
    squares = (states**2).sum(axis=1) + 0.5 * action**2
    found: Vector = 0.5 * (squares + gz.PENALTY * outside.sum(axis=1))
    return found


def _refined(q: Matrix, actions: Vector, chosen: Matrix) -> Vector:
    """The minimum of the parabola through the best input and its neighbours."""
    middle = np.clip(chosen, 1, len(actions) - 2)
    everyone = np.arange(q.shape[1])
    left, here, right = (q[middle + k, everyone] for k in (-1, 0, 1))
    bend = left - 2 * here + right
    shift = np.where(bend > 1e-12, 0.5 * (left - right) / np.maximum(bend, 1e-12), 0)
    step = actions[1] - actions[0]
    found: Vector = np.clip(actions[middle] + np.clip(shift, -1, 1) * step, -1, 1)
    return found
