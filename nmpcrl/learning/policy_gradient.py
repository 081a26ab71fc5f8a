"""The deterministic policy gradient of an NMPC, with a compatible critic.

The policy is pi_theta(s) = u_0, and its Jacobian dpi / dtheta, shape (m, d), is exact. The critic
is linear: V_v(s) = v'phi(s) with `monomials`, and A_w(s, a) = w'psi with
psi = (dpi / dtheta)' (a - pi(s)), which is compatible: with it the gradient of the return is exact
(Silver et al. 2014).
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc
from nmpcrl.learning.batches import Statistics, batched
from nmpcrl.learning.bootstrap import NextValue, Transition
from nmpcrl.learning.learners import Learner
from nmpcrl.learning.optimisers import Bounds, Descent, Optimiser


def monomials(state: Vector) -> Vector:
    """phi, of a quadratic value: 1, s_i and s_i s_j, i <= j."""
    rows, columns = np.triu_indices(state.size)
    return np.concatenate([[1.0], state, state[rows] * state[columns]])


class CriticMeans(NamedTuple):
    """Means over a batch, of which v and w are made."""

    value_matrix: Matrix  #: phi (phi - gamma phi+)'
    value_vector: Vector  #: phi l
    advantage_matrix: Matrix  #: psi psi'
    advantage_vector: Vector  #: psi l
    coupling: Matrix  #: psi (gamma phi+ - phi)'
    fisher: Matrix  #: (dpi / dtheta)' dpi / dtheta


def ridge(A: Matrix, b: Vector, regularisation: float) -> Vector:
    """The x that is least in ||A x - b||^2 + regularisation ||x||^2."""
    found: Any = np.linalg.solve(A.T @ A + regularisation * np.eye(b.size), A.T @ b)
    return np.asarray(found)


def lstd_value(means: CriticMeans, regularisation: float) -> Vector:
    """v of LSTD: mean(phi (l + gamma v'phi+ - v'phi)) = 0; Bradtke and Barto (1996)."""
    return ridge(means.value_matrix, means.value_vector, regularisation)


def lstd_advantage(means: CriticMeans, v: Vector, regularisation: float) -> Vector:
    """w: the TD error of v regressed on psi, mean(psi (l + gamma v'phi+ - v'phi - w'psi)) = 0."""
    target = means.advantage_vector + means.coupling @ v
    return ridge(means.advantage_matrix, target, regularisation)


def no_successor(transition: Transition, theta: Vector) -> NextValue:
    """The critic values states, so no value is taken from the NMPC."""
    return NextValue(np.nan)


def policy_statistics(nmpc: Nmpc, transition: Transition, _: float) -> CriticMeans:
    """What one step adds to `CriticMeans`; ValueError where u_0 was fixed: that is no policy."""
    solution = transition.solution
    if solution.ocp.fixed_action.size:
        raise ValueError(
            "a policy gradient needs the plan with u_0 free: call train without constrained"
        )
    jacobian = nmpc.policy_jacobian(solution)
    phi = monomials(transition.state)
    phi_next = np.zeros_like(phi) if transition.end else monomials(transition.next_state)
    psi = jacobian.T @ (transition.action - solution.action)
    change, cost = nmpc.gamma * phi_next - phi, transition.cost
    return CriticMeans(
        np.outer(phi, -change), phi * cost, np.outer(psi, psi), psi * cost, np.outer(psi, change),
        jacobian.T @ jacobian,
    )  # fmt: skip


def policy_gradient_estimate(regularisation: float, *found: Any) -> Statistics:
    """dJ / dtheta = F w and F = mean((dpi / dtheta)' dpi / dtheta); Gros and Zanon (2020)."""
    means = CriticMeans(*found)
    w = lstd_advantage(means, lstd_value(means, regularisation), regularisation)
    return means.fisher @ w, means.fisher


def policy_gradient(
    nmpc: Nmpc,
    alpha: float = 1e-3,
    *,
    every: int | None = None,
    optimiser: Optimiser | None = None,
    regularisation: float = 1e-6,
    bounds: Bounds | None = None,
) -> Learner:
    """DPG: theta <- theta - alpha dJ / dtheta, estimated anew from each batch; one solve a step.

    It needs exploration: without it a = pi(s), and nothing is learned. It has means where other
    texts have sums, so that alpha does not depend on the length of an episode.

    Source: Gros and Zanon (2020), with the critic by LSTD of Gros and Zanon (2021).

    Args:
        nmpc: the controller.
        alpha: step size.
        every: steps of a batch; those of an episode if absent.
        optimiser: of the gradient and the mean of dpi'dpi for a curvature, with which the step of
            `GaussNewton` is the natural gradient. `Descent(alpha)` if absent.
        regularisation: of the two least-squares fits.
        bounds: the least and the largest theta; those of a `Problem` if absent.
    """
    estimate = partial(policy_gradient_estimate, regularisation)
    sample = partial(policy_statistics, nmpc)
    rule = batched(sample, optimiser or Descent(alpha), every, estimate)
    return Learner.of("DPG", nmpc, rule, no_successor, bounds)
