"""Where a cold solve may begin besides standing still: inputs that are held, and drawn ones."""

from collections.abc import Iterator
from itertools import islice, product

import casadi as ca
import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.problem import Problem

SHARES = (0.4, 1.0)  # of the bounds near which inputs are held
CORNERS = 8  # of the box of inputs, at most, with each share
GROWS = 30.0  # what a deviation from rest has to become, in itself, for a start of its own
LEAST = 1e-6  # curvature of a cost that is made convex, in parts of the largest
PUSH = 1.01e-2  # inside its bounds an input stays, that of `kernel`, so that it is not moved there
MOST = 64  # cold starts that can be asked for


def cold_inputs(of: Problem, horizon: int, count: int) -> list[Matrix]:
    """The inputs of the cold starts that follow the one at rest, each of shape (horizon, m)."""
    return list(islice(_inputs(of, horizon), count))


def random_inputs(of: Problem, seed: int, horizon: int) -> Matrix:
    """Inputs drawn within their bounds, and near 0 where these are wide, shape (horizon, m)."""
    lower, upper = _sides(of)
    return np.random.default_rng(seed).uniform(lower, upper, (horizon, lower.size))


class Regulator:
    """Inputs for a model that falls over at rest: the plan of one LQ problem, held by its feedback.

    The problem is linearised where every stage stands still at s. That is no plan, so its sweep
    closes the defects f(s, 0) - s; the model is then rolled out under u = k + K (x - s).
    Source: Giftthaler et al. (2018), "A family of iterative Gauss-Newton shooting methods".
    """

    def __init__(self, problem: Problem) -> None:
        e = problem.expressions
        z = ca.vertcat(e.x, e.u)
        slopes = ca.jacobian(e.next_x, z)
        self._problem = problem
        push = PUSH * np.minimum(1.0, problem.upper - problem.lower)
        self._lower, self._upper = problem.lower + push, problem.upper - push
        self._still = np.clip(np.zeros(problem.inputs), self._lower, self._upper)
        given = [e.x, e.u, e.theta, e.d]
        self._step = ca.Function("step", given, [e.next_x])
        self._stage = ca.Function("stage", given, [e.next_x, slopes, *ca.hessian(e.stage, z)])
        self._end = ca.Function("end", [e.x, e.theta, e.d], [*ca.hessian(e.terminal, e.x)])

    def inputs(self, state: Vector, theta: Vector, data: Matrix, *action: Vector) -> Matrix | None:
        """The inputs, shape (N, m), u_0 = `action` if given; None if the model does not grow at s.

        Nor are there any where a number is not finite.
        """
        slopes = self.slopes(state, theta, data)
        growth = np.abs(np.linalg.matrix_power(slopes, self._problem.horizon)).max()
        if growth <= GROWS:
            return None
        still, gains = self._still, self._gains(state, theta, data)
        inputs: Matrix = np.empty((len(gains), still.size))
        x = state
        for i, (k, K) in enumerate(gains):
            inputs[i] = np.clip(still + k + K @ (x - state), self._lower, self._upper)
            if i == 0 and action:
                inputs[0] = action[0]
            x = self._step(x, inputs[i], theta, self._problem.own(data[i])).full().ravel()
        return inputs if np.isfinite(inputs).all() else None

    def slopes(self, state: Vector, theta: Vector, data: Matrix) -> Matrix:
        """The model's derivative in the state at rest, shape (n, n)."""
        of_state_and_input: Matrix = self._stage(
            state, self._still, theta, self._problem.own(data[0])
        )[1].full()
        return of_state_and_input[:, : state.size]

    def states(self, state: Vector, inputs: Matrix, theta: Vector, data: Matrix) -> Matrix:
        """Where inputs lead from a state, shape (N + 1, n)."""
        found = [state]
        for u, d in zip(inputs, data, strict=False):
            found.append(self._step(found[-1], u, theta, self._problem.own(d)).full().ravel())
        return np.array(found)

    def _gains(self, state: Vector, theta: Vector, data: Matrix) -> list[tuple[Vector, Matrix]]:
        """k and K of every stage, from the last to the first and turned around."""
        n, gamma, found = state.size, self._problem.gamma, []
        P, p = (value.full() for value in self._end(state, theta, self._problem.own(data[-1])))
        P, p = _convex(P), p.ravel()
        for i in range(self._problem.horizon - 1, -1, -1):
            values = self._stage(state, self._still, theta, self._problem.own(data[i]))
            after, slopes, bend, slope = (value.full() for value in values)
            bend, to_go = _convex(bend), gamma * P  # discounted as seen from this stage
            ahead = gamma * p + to_go @ (after.ravel() - state)
            H, h = bend + slopes.T @ to_go @ slopes, slope.ravel() + slopes.T @ ahead
            K, k = np.split(-np.linalg.solve(H[n:, n:], np.c_[H[n:, :n], h[n:]]), [n], axis=1)
            found.append((k.ravel(), K))
            P, p = H[:n, :n] + H[:n, n:] @ K, h[:n] + H[:n, n:] @ k.ravel()
            P = (P + P.T) / 2
        return found[::-1]


def _convex(bend: Matrix) -> Matrix:
    """The nearest matrix that bends upwards in every direction."""
    bend = np.nan_to_num(bend)
    values, vectors = np.linalg.eigh((bend + bend.T) / 2)
    return np.asarray((vectors * np.maximum(values, LEAST * max(1.0, *values))) @ vectors.T)


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
