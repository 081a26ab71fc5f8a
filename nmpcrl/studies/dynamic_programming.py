"""The best policy of the plant of `gros_zanon`, by dynamic programming on a grid of states.

Howard's policy iteration interpolates values bilinearly between the points of the grid, and takes
the expectation over e at the midpoints of equal intervals.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.interpolate import interpn
from scipy.sparse.linalg import spsolve

from nmpcrl import Matrix, Vector
from nmpcrl.study.problems import gros_zanon as gz

LEAST, MOST = np.array([-0.6, -1.2]), np.array([1.4, 1.2])  # corners of the grid
SWEEPS = 100  # of policy iteration, at most
NODES = 8  # midpoints at which the disturbance is taken
CORNERS = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])  # of a cell of the grid


class Grid(NamedTuple):
    """The value and the best input at each point of the grid."""

    axes: Matrix  # shape (2, points)
    value: Matrix  # shape (points, points)
    policy: Matrix  # shape (points, points)

    def action(self, state: Vector) -> Vector:
        """The input in a state, shape (1,)."""
        found: Vector = interpn(self.axes, self.policy, np.clip(state, LEAST, MOST))
        return np.clip(found, -1, 1)


def best(points: int, inputs: int) -> Grid:
    """The best policy on points^2 states, by `inputs` in [-1, 1]; a parabola refines the best."""
    axes = np.linspace(LEAST, MOST, points).T
    states = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    actions, everyone = np.linspace(-1, 1, inputs), np.arange(len(states))
    moves = [_transition(states, np.array([a]), axes) for a in actions]
    outside = np.maximum(0, gz.LOWER - states) + np.maximum(0, states - gz.UPPER)
    squares = (states**2).sum(axis=1) + 0.5 * actions[:, None] ** 2
    costs = 0.5 * (squares + gz.PENALTY * outside.sum(axis=1))
    chosen = np.zeros(len(states), int)
    for _ in range(SWEEPS):
        closed = _transition(states, actions[chosen, None], axes)
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


def _transition(states: Matrix, action: Matrix, axes: Matrix) -> sparse.csr_array:
    """The probability of each successor of each point, by bilinear weights."""
    low, high = gz.DISTURBANCE
    e = low + (np.arange(NODES) + 0.5) / NODES * (high - low)
    later = (states @ gz.TRUE_A.T + action * gz.TRUE_B[:, 0])[:, None] + np.c_[e, np.zeros(NODES)]
    last = axes.shape[1] - 1
    at = np.clip((later - LEAST) / (axes[:, 1] - axes[:, 0]), 0, last)
    below = np.minimum(at.astype(int), last - 1)
    above = (at - below)[:, :, None]  # share of the way to the next point
    weights = np.where(CORNERS, above, 1 - above).prod(axis=-1) / NODES
    columns = (below[:, :, None] + CORNERS) @ [last + 1, 1]
    ends = np.arange(len(states) + 1) * (4 * NODES)
    found = sparse.csr_array((weights.ravel(), columns.ravel(), ends), (len(states),) * 2)
    found.sum_duplicates()
    return found


def _refined(q: Matrix, actions: Vector, chosen: NDArray[np.int_]) -> Vector:
    """The minimum of the parabola through the best input and its neighbours."""
    middle = np.clip(chosen, 1, len(actions) - 2)
    left, here, right = (q[middle + k, np.arange(q.shape[1])] for k in (-1, 0, 1))
    bend = left - 2 * here + right
    shift = np.where(bend > 1e-12, 0.5 * (left - right) / np.maximum(bend, 1e-12), 0)
    refined: Vector = actions[middle] + np.clip(shift, -1, 1) * (actions[1] - actions[0])
    return np.clip(refined, -1, 1)
