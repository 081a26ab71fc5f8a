"""The plant of `gros_zanon` without disturbance, bounds and penalty; A, B, Q and R are learned.

The value and the policy of a theta solve Riccati's equation, and the cost of a policy Lyapunov's.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov

from nmpcrl import Matrix, Vector
from nmpcrl.control import Problem
from nmpcrl.study.problems.gros_zanon import GAMMA, HORIZON, TRUE_A, TRUE_B, WRONG_A, WRONG_B

START = np.array([1.0, -0.5])
Q, R = np.eye(2), np.array([[0.5]])  # of the plant's cost


@dataclass(frozen=True, eq=False)
class Truth:
    """The policy u = -K x, whose cost from x is x' P x."""

    K: Matrix
    P: Matrix

    @property
    def cost(self) -> float:
        """The cost from the start."""
        return float(START @ self.P @ START)


def problem(*, informed: bool = False) -> Problem:
    """The plan, of which A, B, Q, R, the terminal P and a constant V0 are learned.

    An `informed` theta begins at the truth, P included.
    """
    a, b = (TRUE_A, TRUE_B) if informed else (WRONG_A, WRONG_B)
    return Problem(
        states=2,
        inputs=1,
        horizon=HORIZON,
        gamma=GAMMA,
        theta={"V0": 0.0, "A": a, "B": b, "Q": Q, "R": R, "P": optimal(a, b).P},
        model=lambda x, u, th: th["A"] @ x + th["B"] @ u,
        stage=lambda x, u, th: x.T @ th["Q"] @ x + u.T @ th["R"] @ u,
        terminal=lambda x, th: x.T @ th["P"] @ x,
        initial=lambda x, th: th["V0"],
    )


def plant(state: Vector, action: Vector, rng: np.random.Generator) -> tuple[Vector, float, bool]:
    """A step of the plant: next state, cost, and no end."""
    later = TRUE_A @ state + TRUE_B @ action
    return later, float(state @ Q @ state + action @ R @ action), False


def optimal(a: Matrix = TRUE_A, b: Matrix = TRUE_B) -> Truth:
    """The best policy of a model and its value, by Riccati's equation of sqrt(gamma) (A, B)."""
    root = np.sqrt(GAMMA)
    p = solve_discrete_are(root * a, root * b, Q, R)
    return Truth(gain(a, b, R, p), p)


def gain(a: Matrix, b: Matrix, r: Matrix, p: Matrix) -> Matrix:
    """K of the input that minimises u'R u + gamma (A x + B u)'P (A x + B u)."""
    return np.asarray(np.linalg.solve(r + GAMMA * b.T @ p @ b, GAMMA * b.T @ p @ a))


def worth(k: Matrix) -> Truth:
    """The cost of u = -K x on the plant, by Lyapunov's equation; infinite where it diverges."""
    closed = np.sqrt(GAMMA) * (TRUE_A - TRUE_B @ k)
    if np.abs(np.linalg.eigvals(closed)).max() >= 1:
        return Truth(k, np.diag([np.inf, np.inf]))
    return Truth(k, solve_discrete_lyapunov(closed.T, Q + k.T @ R @ k))


def planned(theta: Vector) -> Truth:
    """The policy and the value, without V0, of a theta's plan, by Riccati's recursion."""
    parts = problem().split(theta)
    a, b, q, r, p = (parts[name] for name in "ABQRP")
    q, p = (q + q.T) / 2, (p + p.T) / 2  # which have the same costs
    k = np.zeros((b.shape[1], a.shape[0]))
    for _ in range(HORIZON):
        k = gain(a, b, r, p)
        closed: Matrix = a - b @ k
        p = q + k.T @ r @ k + GAMMA * closed.T @ p @ closed
    return Truth(k, p)
