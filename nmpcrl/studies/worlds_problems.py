"""Problems of the robot whose model or terminal cost is learned, too."""

from functools import cache
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Problem
from nmpcrl.control.problem import Parameter
from nmpcrl.learning.rollout import Persistent
from nmpcrl.study import moving
from nmpcrl.study.faults import Fault, robot
from nmpcrl.study.moving import TARGET, diagonal, square, transition

TERMINALS = ("diagonal", "full", "learned")  # the paper's first
BELOW = ((1, 0), (2, 0), (2, 1))  # entries of the triangular factor of V^f that the paper leaves 0
BUMPS = np.array([(x, y) for x in np.linspace(-1, 7, 5) for y in np.linspace(-1, 5, 5)])  # [m]
WIDTHS = np.array([2.0, 1.5])  # of a bump, along x and y [m]: the distance to the next
HEIGHT = 1000.0  # of a bump of weight 1: V_theta(s) itself is some thousands
TURNS, MOVES = np.array([0.0, 1.0]), np.eye(2, 3)  # the input of the bias, the states of the drift
MODEL = {
    "gain": Parameter(np.eye(2), -2.0, 2.0),
    "bias": Parameter(0.0, -1.0, 1.0),
    "drift": Parameter(np.zeros(2), -0.5, 0.5),
}


def learned_transition(x: Any, u: Any, th: Any, _: Any) -> Any:
    """The robot's model under gain u + (0, bias), and then drift."""
    applied = th["gain"] @ u + th["bias"] * TURNS
    return robot().transition(x, applied) + robot().period * (th["drift"].T @ MOVES).T


def full(x: Any, th: Any, _: Any) -> Any:
    """Any positive semidefinite quadratic terminal cost of x - s_ref, by a triangular factor."""
    away = x - TARGET
    scaled = [th["f"][i] * away[i] for i in range(3)]
    for k, (i, j) in enumerate(BELOW):
        scaled[i] += th["below"][k] * away[j]
    return square(scaled, 3)


def bumps(x: Any, th: Any, _: Any) -> Any:
    """The paper's terminal cost plus a weighted sum of `BUMPS`."""
    cost = diagonal(x, th)
    for k, bump in enumerate(BUMPS):
        cost += HEIGHT * th["bumps"][k] / (1 + square((x[:2] - bump) / WIDTHS, 2)) ** 2
    return cost


COSTS: dict[str, tuple[Any, dict[str, Any]]] = {  # and the parameters, 0 where learning begins
    "diagonal": (diagonal, {}),
    "full": (full, {"below": np.zeros(len(BELOW))}),
    "learned": (bumps, {"bumps": np.zeros(len(BUMPS))}),
}


def problem(
    obstacles: int = 4, *, learned_model: bool = False, terminal: str = TERMINALS[0]
) -> Problem:
    """`moving.problem` with a learned model, or a terminal cost of `TERMINALS`."""
    cost, parameters = COSTS[terminal]
    return moving.problem(
        obstacles,
        model=learned_transition if learned_model else transition,
        terminal=cost,
        further=(MODEL if learned_model else {}) | parameters,
    )


@cache
def controller(
    obstacles: int = 4, *, learned_model: bool = False, terminal: str = TERMINALS[0]
) -> Persistent:
    """The NMPC of `problem`, compiled once."""
    return Persistent(Nmpc(problem(obstacles, learned_model=learned_model, terminal=terminal)))


def oracle(fault: Fault) -> Vector:
    """Theta_init with the parameters of the model that fit the fault best."""
    return problem(learned_model=True).vector(**fault.model)
