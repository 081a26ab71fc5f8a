"""Two states and one parameter: the smallest problem on which a semi-gradient diverges.

    first --cost 0--> second --cost 0--> end

The approximate values are theta in the first state, 2 theta in the second and 0 at the end;
theta = 0 is exact. Tsitsiklis and Van Roy (1997); Sutton and Barto (2018), Section 11.2.
"""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.learning import Learner, NextValue, Transition, UpdateRule, Weights, td_error

FIRST, SECOND = 0, 1
PHI = np.array([[1.0], [2.0]])  # features of the two states, one row a state
PHI_NEXT = np.array([[2.0], [0.0]])  # of the states that follow them
COST = 0.0  # of either step


@dataclass(frozen=True)
class Chain:
    """The chain, and how often each of its states is updated."""

    gamma: float = 0.97
    share: float = 1.0  #: of updates made in the first state; on-policy visits give 1/2

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0 <= value <= 1:
                raise ValueError(f"{name} = {value} must lie in [0, 1]")

    @property
    def probabilities(self) -> Vector:
        """Share of the updates made in each state, shape (2,)."""
        return np.array([self.share, 1 - self.share])

    def delta(self, theta: Vector, state: int) -> float:
        """TD error of the step out of `state`: Eq. (7)."""
        q, q_next = float(PHI[state] @ theta), float(PHI_NEXT[state] @ theta)
        return td_error(COST, self.gamma, q, q_next)


def sampled_step(chain: Chain, rule: UpdateRule, weights: Weights, state: int) -> Weights:
    """One update in `state`."""
    here, there = (NextValue(float(phi[state] @ weights.theta), phi[state])
                   for phi in (PHI, PHI_NEXT))  # fmt: skip
    nowhere, solution = np.zeros(0), cast(Any, here)  # which has the features that rules read
    transition = Transition(nowhere, nowhere, COST, nowhere, solution)
    learner = Learner("chain", lambda *_: there, rule, chain.gamma)
    return learner.step(weights, transition).weights


def expected_step(chain: Chain, rule: UpdateRule, weights: Weights) -> Weights:
    """The mean of `sampled_step` over the states."""
    steps = [sampled_step(chain, rule, weights, state) for state in (FIRST, SECOND)]
    return Weights(
        theta=chain.probabilities @ [step.theta for step in steps],
        w=chain.probabilities @ [step.w for step in steps],
    )


def follow(
    chain: Chain, rule: UpdateRule, updates: int, *, rng: np.random.Generator | None = None
) -> Matrix:
    """(theta, w) before the first update, (1, 0), and after each, shape (updates + 1, 2).

    `rng` draws the state of each update; without it updates are expected ones.
    """
    path = [Weights(np.ones(1), np.zeros(1))]
    for _ in range(updates):
        if rng is None:
            path.append(expected_step(chain, rule, path[-1]))
        else:
            state = int(rng.random() >= chain.share)
            path.append(sampled_step(chain, rule, path[-1], state))
    return np.array([[step.theta[0], step.w[0]] for step in path])


def expected_matrix(chain: Chain, rule: UpdateRule) -> Matrix:
    """The expected update as a matrix on (theta, w), shape (2, 2): on this chain it is linear."""
    units = Weights(np.ones(1), np.zeros(1)), Weights(np.zeros(1), np.ones(1))
    moved = [expected_step(chain, rule, unit) for unit in units]
    return np.array([[step.theta[0], step.w[0]] for step in moved]).T


def spectral_radius(chain: Chain, rule: UpdateRule) -> float:
    """Largest modulus of an eigenvalue of `expected_matrix`: below 1 the updates converge to 0."""
    return float(np.abs(np.linalg.eigvals(expected_matrix(chain, rule))).max())


def auxiliary_fixed_point(chain: Chain, theta: float) -> float:
    """The fixed point of w's expected update for one theta: E[phi phi']^-1 E[delta phi]."""
    return _correlation(chain, theta) / float(chain.probabilities @ PHI[:, 0] ** 2)


def mspbe(chain: Chain, theta: float) -> float:
    """The mean-square projected Bellman error as expectations: Eq. (15)."""
    return auxiliary_fixed_point(chain, theta) * _correlation(chain, theta)


def _correlation(chain: Chain, theta: float) -> float:
    """E[delta phi]."""
    delta = [chain.delta(np.array([theta]), state) for state in (FIRST, SECOND)]
    return float(chain.probabilities @ (delta * PHI[:, 0]))


def projected_bellman_error(chain: Chain, theta: float) -> float:
    """The same error by its definition, Eq. (14): back up both values, project, and compare."""
    rho, basis = chain.probabilities, PHI[:, 0]
    values = basis * theta
    backed_up = COST + chain.gamma * PHI_NEXT[:, 0] * theta
    projected = basis * (rho @ (basis * backed_up)) / (rho @ basis**2)
    return float(rho @ (projected - values) ** 2)
