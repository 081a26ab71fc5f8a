"""A linear plant with a quadratic cost; A, B, Q and R are learned.

Riccati's equation gives the value and the policy of every theta, and Lyapunov's the cost of a
policy.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov

from nmpcrl import Matrix, Vector
from nmpcrl.control import Problem

GAMMA, HORIZON = 0.9, 10
START = np.array([1.0, -0.5])
A, B = np.array([[0.9, 0.35], [0.0, 1.1]]), np.array([[0.0813], [0.2]])  # of the plant
Q, R = np.eye(2), np.array([[0.5]])  # of its cost
WRONG_A, WRONG_B = np.array([[1.0, 0.25], [0.0, 1.0]]), np.array([[0.0312], [0.25]])


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

    Args:
        informed: whether theta begins at the truth, P included.
    """
    model = (A, B) if informed else (WRONG_A, WRONG_B)
    best = optimal(*model)
    return Problem(
        states=2,
        inputs=1,
        horizon=HORIZON,
        gamma=GAMMA,
        theta={"V0": 0.0, "A": model[0], "B": model[1], "Q": Q, "R": R, "P": best.P},
        model=lambda x, u, th: th["A"] @ x + th["B"] @ u,
        stage=lambda x, u, th: x.T @ th["Q"] @ x + u.T @ th["R"] @ u,
        terminal=lambda x, th: x.T @ th["P"] @ x,
        initial=lambda x, th: th["V0"],
    )


def plant(state: Vector, action: Vector, rng: np.random.Generator) -> tuple[Vector, float, bool]:
    """A step of the plant: next state, cost, and no end."""
    later = A @ state + B @ action
    return later, float(state @ Q @ state + action @ R @ action), False


def optimal(a: Matrix = A, b: Matrix = B) -> Truth:
    """The best policy of a model and its value, by Riccati's equation of sqrt(gamma) (A, B)."""
    root = np.sqrt(GAMMA)
    p = solve_discrete_are(root * a, root * b, Q, R)
    return Truth(gain(a, b, R, p), p)


def gain(a: Matrix, b: Matrix, r: Matrix, p: Matrix) -> Matrix:
    """K of the input that minimises u'R u + gamma (A x + B u)'P (A x + B u)."""
    found: Any = np.linalg.solve(r + GAMMA * b.T @ p @ b, GAMMA * b.T @ p @ a)
    return np.asarray(found)


def worth(k: Matrix) -> Truth:
    """The cost of u = -K x on the plant, by Lyapunov's equation; infinite where it diverges."""
    closed = np.sqrt(GAMMA) * (A - B @ k)
    if np.abs(np.linalg.eigvals(closed)).max() >= 1:
        return Truth(k, np.diag([np.inf, np.inf]))
    return Truth(k, solve_discrete_lyapunov(closed.T, Q + k.T @ R @ k))


def planned(theta: Vector) -> Truth:
    """The policy and the value, without V0, of a theta's plan, by Riccati's recursion.

    Q and P count as (Q + Q') / 2.
    """
    parts = problem().split(theta)
    a, b, q, r, p = (parts[name] for name in "ABQRP")
    q, p = (q + q.T) / 2, (p + p.T) / 2
    k = np.zeros((b.shape[1], a.shape[0]))
    for _ in range(HORIZON):
        k = gain(a, b, r, p)
        closed: Matrix = a - b @ k
        p = q + k.T @ r @ k + GAMMA * closed.T @ p @ closed
    return Truth(k, p)
