"""Gauss-Newton within a trust region, on the TD error and on the closed loop's cost J.

The gradient of J follows from the sensitivities of the visited states. With s+ = f(s, a) and
a = pi_theta(s) + noise, the noise held,

    da/dtheta = dpi/dtheta + dpi/ds ds/dtheta,  ds+/dtheta = df/ds ds/dtheta + df/da da/dtheta.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc
from nmpcrl.learning.batches import Batched, lstd_q
from nmpcrl.learning.bootstrap import Controller, NextValue, Transition
from nmpcrl.learning.learners import Learner, Weights
from nmpcrl.learning.optimisers import Bounds, Optimiser
from nmpcrl.learning.policy_gradient import no_successor

STEP = 1e-5  # of central differences
HALVINGS = 60  # of the interval in which the multiplier lies
LEAST = 1e-12  # curvature, in parts of the largest


@dataclass(frozen=True, eq=False)
class TrustRegion:
    """theta + p, where p is least in g'p + p'H p / 2 and ||p / scale|| at most `radius`.

    Where the region binds, (H + mu S^-2) p = -g with the mu > 0 that puts p on its edge; H may be
    indefinite.  Source: Moré and Sorensen (1983).
    """

    radius: float
    scale: Vector  # a typical change of each component of theta, shape (d,)

    def init(self, theta: Vector) -> None:
        """It remembers nothing."""

    def step(
        self, memory: None, theta: Vector, gradient: Vector, curvature: Matrix | None = None
    ) -> tuple[Vector, None]:
        """The minimiser.

        Raises:
            ValueError: there is no curvature.
        """
        if curvature is None:
            raise ValueError("TrustRegion needs a curvature, and this rule estimates none")
        scaled = curvature * np.outer(self.scale, self.scale)
        if not np.isfinite(scaled).all():
            return np.full_like(theta, np.inf), None  # which `train` calls diverged
        values, basis = np.linalg.eigh(scaled)
        slope = basis.T @ (self.scale * gradient)
        return theta - self.scale * (basis @ self._within(values, slope)), None

    def _within(self, values: Vector, slope: Vector) -> Vector:
        """slope / (values + mu) with the least mu >= 0 that makes it convex and short enough."""
        floor = LEAST * max(1.0, float(np.abs(values).max()))
        low = max(0.0, floor - float(values[0]))
        if np.linalg.norm(slope / (values + low)) <= self.radius:
            return np.asarray(slope / (values + low))
        high = low + float(np.linalg.norm(slope)) / self.radius
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            short = np.linalg.norm(slope / (values + middle)) <= self.radius
            low, high = (low, middle) if short else (middle, high)
        return np.asarray(slope / (values + high))


def lstd_q_within(
    nmpc: Controller, region: Optimiser, *, every: int | None = None, bounds: Bounds | None = None
) -> Learner:
    """`lstd_q`, Gauss-Newton on the TD error, whose steps stay in a trust region."""
    learner = lstd_q(nmpc, every=every, bounds=bounds)
    assert isinstance(learner.rule, Batched)
    return replace(learner, name="LSTD-Q trusted", rule=replace(learner.rule, optimiser=region))


class Sensitivities(NamedTuple):
    """What `ClosedLoop` remembers of an episode."""

    states: Matrix  # ds / dtheta, shape (n, d)
    gradient: Vector  # of J, so far, shape (d,)
    curvature: Matrix  # shape (d, d)
    optimiser: Any


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A `StatefulRule` that moves theta after each episode by a Gauss-Newton step on J.

    J is the summed cost of the episode as it went, and its curvature the sum of
    2 (ds/dtheta)' diag(Q) ds/dtheta, of the part of Eq. (20) that is a sum of squares. The model
    of the plan gives the derivatives, by differences, and no rollout is spent on them.
    """

    nmpc: Nmpc
    controller: Controller  # which solves again what failed
    optimiser: Optimiser

    def init(self, weights: Weights) -> Sensitivities:
        """The start does not depend on theta."""
        d = weights.theta.size
        return Sensitivities(
            np.zeros((self.nmpc.n, d)), np.zeros(d), np.zeros((d, d)),
            self.optimiser.init(weights.theta),
        )  # fmt: skip

    def step(
        self,
        memory: Sensitivities,
        weights: Weights,
        transition: Transition,
        delta: float,
        successor: NextValue,
    ) -> tuple[Weights, Sensitivities]:
        """Carry the sensitivities on; move theta where the episode is over."""
        if transition.first:  # the one before may have ended in a failed solve
            memory = self.init(weights)._replace(optimiser=memory.optimiser)
        state, action = transition.state, transition.action
        inputs = self.policy_slopes(transition, weights.theta, memory.states)
        plant, task = self.nmpc.plant, self.nmpc.task

        def charge(x: Vector, u: Vector) -> Vector:
            return np.array([task.stage_cost(x, u)])

        cost_s, cost_a = slopes(charge, state, action)
        gradient = memory.gradient + (cost_s @ memory.states + cost_a @ inputs)[0]
        curvature = memory.curvature + 2 * memory.states.T @ (task.weights[:, None] * memory.states)
        if transition.last:
            theta, kept = self.optimiser.step(memory.optimiser, weights.theta, gradient, curvature)
            moved = Weights(theta, weights.w)
            return moved, self.init(moved)._replace(optimiser=kept)
        later_s, later_a = slopes(plant.step, state, action)
        states = later_s @ memory.states + later_a @ inputs
        return weights, Sensitivities(states, gradient, curvature, memory.optimiser)

    def policy_slopes(self, transition: Transition, theta: Vector, states: Matrix) -> Matrix:
        """da / dtheta, shape (m, d): 0 where noise took the action to its bound."""
        solution, action = transition.solution, transition.action

        def policy(state: Vector, _: Vector) -> Vector:
            return self.controller.solve(state, theta, solution).action

        by_state, _ = slopes(policy, transition.state, action[:0])
        slope = self.controller.policy_jacobian(solution) + by_state @ states
        bound = (action <= self.nmpc.lower) | (action >= self.nmpc.upper)
        return np.where(bound[:, None], 0.0, slope)


def slopes(function: Any, state: Vector, action: Vector) -> tuple[Matrix, Matrix]:
    """The Jacobians of a function of state and action in either, by central differences."""
    h, k = STEP * np.eye(state.size), STEP * np.eye(action.size)
    by_state = [(function(state + e, action) - function(state - e, action)) / (2 * STEP) for e in h]
    by_action = [
        (function(state, action + e) - function(state, action - e)) / (2 * STEP) for e in k
    ]
    return np.transpose(by_state), np.transpose(by_action)


def closed_loop(controller: Any, optimiser: Optimiser, bounds: Bounds | None = None) -> Learner:
    """GN-J: Gauss-Newton on the cost of the closed loop, by the policy's sensitivity.

    Args:
        controller: an `Nmpc` with a task, or an object that holds one as `nmpc`.
        optimiser: `TrustRegion`, or another that takes a curvature.
        bounds: the least and the largest theta.

    Raises:
        ValueError: the controller has no task, whose cost and plant are differentiated.
    """
    nmpc = controller if isinstance(controller, Nmpc) else controller.nmpc
    if nmpc.task is None:
        raise ValueError("GN-J differentiates a task's cost and its plant: a Problem has neither")
    rule = ClosedLoop(nmpc, controller, optimiser)
    return Learner("GN-J", no_successor, rule, nmpc.gamma, bounds)
