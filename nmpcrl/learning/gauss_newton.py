"""Gauss-Newton on the closed loop's cost J.

The gradient of J follows from the sensitivities of the visited states. With s+ = f(s, a) and
a = pi_theta(s) + noise, the noise held,

    da/dtheta = dpi/dtheta + dpi/ds ds/dtheta,  ds+/dtheta = df/ds ds/dtheta + df/da da/dtheta.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc
from nmpcrl.control.derivatives import StageDerivatives
from nmpcrl.learning.bootstrap import Transition
from nmpcrl.learning.learners import Learner, UpdateRule, Weights
from nmpcrl.learning.optimisers import Bounds, Optimiser
from nmpcrl.learning.policy_gradient import no_successor


class Sensitivities(NamedTuple):
    """The memory of `ClosedLoop`, of an episode."""

    states: Matrix  #: ds / dtheta, shape (n, d)
    gradient: Vector  #: of J, so far, shape (d,)
    curvature: Matrix  #: shape (d, d)


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """The functions of a rule that moves theta after each episode by a Gauss-Newton step on J.

    J is the summed cost of the episode as it went; its curvature is the sum of y' l_yy y with
    y = (ds/dtheta, da/dtheta). Model, cost and policy of the plan are differentiated exactly.
    """

    nmpc: Nmpc
    optimiser: Optimiser
    derivatives: StageDerivatives

    def init(self, weights: Weights) -> Sensitivities:
        """Zeros: the start does not depend on theta."""
        d = weights.theta.size
        return Sensitivities(np.zeros((self.nmpc.n, d)), np.zeros(d), np.zeros((d, d)))

    def step(
        self, theta: Vector, memory: Sensitivities, transition: Transition, *_: Any
    ) -> tuple[Vector, Sensitivities]:
        """Carry the sensitivities on; move theta where the episode is over."""
        if transition.first:  # the one before may have ended in a failed solve
            memory = self.init(Weights(theta))
        model, cost, bends = self.derivatives(transition.solution, transition.action)
        y = np.vstack([memory.states, self.action_jacobian(transition, memory.states)])
        gradient, curvature = memory.gradient + cost @ y, memory.curvature + y.T @ bends @ y
        if transition.last:
            theta = self.optimiser(theta, gradient, curvature)
        return theta, Sensitivities(model @ y, gradient, curvature)

    def action_jacobian(self, transition: Transition, states: Matrix) -> Matrix:
        """da / dtheta, shape (m, d): 0 where noise took the action to its bound."""
        solution, action = transition.solution, transition.action
        slope = self.nmpc.policy_jacobian(solution) + self.nmpc.policy_feedback(solution) @ states
        bound = (action <= self.nmpc.lower) | (action >= self.nmpc.upper)
        return np.where(bound[:, None], 0.0, slope)


def closed_loop(
    nmpc: Nmpc,
    optimiser: Optimiser,
    bounds: Bounds | None = None,
    cost: Callable[..., Any] | None = None,
) -> Learner:
    """GN-J: Gauss-Newton on the cost of the closed loop, by the policy's sensitivity.

    Args:
        nmpc: its model stands for the plant.
        optimiser: such as `TrustRegion`.
        bounds: the least and the largest theta; those of a `Problem` if absent.
        cost: of the environment, (x, u) -> l in SX, which a `Problem` needs; of a task, Eq. (20).
    """
    own = ClosedLoop(nmpc, optimiser, StageDerivatives(nmpc, cost))
    return Learner.of("GN-J", nmpc, UpdateRule(own.step, own.init), no_successor, bounds)
