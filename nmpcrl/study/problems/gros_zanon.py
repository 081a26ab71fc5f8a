"""The linear example with a wrong model of Gros and Zanon (2020), as in the examples of mpcrl.

The plant is x+ = A x + B u + (e, 0), e uniform in [-0.1, 0]; it pulls the first state across the
bound that the stage cost penalises. All parameters of the plan are learned, from a wrong A and B
and without the mean of e.
"""

from typing import Any

import numpy as np
from scipy.linalg import solve_discrete_are

from nmpcrl import Vector
from nmpcrl.control import Problem, Series, Soft

GAMMA, HORIZON = 0.9, 10
START = np.array([0.0, 0.15])
LOWER, UPPER = np.array([0.0, -1.0]), np.array([1.0, 1.0])  # of the states, softly
PENALTY = 100.0  # of a unit beyond them, halved in the cost

TRUE_A, TRUE_B = np.array([[0.9, 0.35], [0.0, 1.1]]), np.array([[0.0813], [0.2]])
DISTURBANCE = (-0.1, 0.0)  # bounds of e
WRONG_A, WRONG_B = np.array([[1.0, 0.25], [0.0, 1.0]]), np.array([[0.0312], [0.25]])
TERMINAL = solve_discrete_are(WRONG_A, WRONG_B, np.eye(2) / 2, np.eye(1) / 4)  # P
LOOSE = np.array([1.0, 0.0])  # first x_upper of mpcrl's plan, above the plant's bound


def problem(*, informed: bool = False) -> Problem:
    """The plan, which minimises

    V0 + sum_i gamma^i (|x_i|^2 + u_i^2 / 2) / 2 + f'(x_i, u_i) + x_N' P x_N, and
    gamma^(i-1) 100/2 a unit by which x_i leaves its bounds, i = 1, ..., N: f and P are not
    discounted, and the slacks are one stage late, as in mpcrl. P solves Riccati's equation of the
    wrong model. An `informed` theta begins at the plant's A, B, bounds and mean disturbance.
    """
    late: dict[str, Any] = {"weight": PENALTY / 2 / GAMMA, "stages": slice(1, None)}
    mean = np.array([np.mean(DISTURBANCE), 0.0])
    return Problem(
        states=2,
        inputs=1,
        horizon=HORIZON,
        gamma=GAMMA,
        theta={
            "V0": 0.0,
            "x_lower": np.zeros(2),
            "x_upper": np.zeros(2) if informed else LOOSE,
            "b": mean if informed else np.zeros(2),
            "f": np.zeros(3),
            "A": TRUE_A if informed else WRONG_A,
            "B": TRUE_B if informed else WRONG_B,
        },
        model=lambda x, u, th, d: th["A"] @ x + th["B"] @ u + th["b"],
        stage=lambda x, u, th, d: (
            0.5 * (x.T @ x + 0.5 * u**2) + d["undiscounted"] * (th["f"][:2].T @ x + th["f"][2] * u)
        ),
        terminal=lambda x, th, d: d["undiscounted"] * (x.T @ TERMINAL @ x),
        initial=lambda x, th, d: th["V0"],
        soft=[
            Soft(lambda x, u, th, d: th["x_lower"] - x + LOWER, **late),
            Soft(lambda x, u, th, d: x - th["x_upper"] - UPPER, **late),
        ],
        lower=-1.0,
        upper=1.0,
        data={"undiscounted": Series(GAMMA ** -np.arange(HORIZON + 1.0))},
    )


def plant(state: Vector, action: Vector, rng: np.random.Generator) -> tuple[Vector, float, bool]:
    """A step of the plant: next state, cost, and no end."""
    later = TRUE_A @ state + TRUE_B @ action
    later[0] += rng.uniform(*DISTURBANCE)
    return later, cost(state, action), False


def cost(state: Vector, action: Vector) -> float:
    """(|s|^2 + a^2 / 2 + 100' (distance of s from its bounds)) / 2."""
    outside = np.maximum(0, LOWER - state) + np.maximum(0, state - UPPER)
    return float(0.5 * (state @ state + 0.5 * action @ action + PENALTY * outside.sum()))
