"""riccati on thousands of drawn problems, most of them far from what learning visits.

The problem it solves is Eq. (2) with the box as a penalty, so there is always a solution. Here that
problem is written with CasADi: its KKT conditions, and an Ipopt that solves it to 1e-10.
"""

import json
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from nmpcrl.control import Nmpc, Obstacle, Plant, Solution, SolverError, Task, differential_drive
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.sensitivity import lagrangian

ROBOT = differential_drive()
KKT = 2e-8  # what is left of the conditions, each in its own unit: see `residual`
HARDEST = json.loads(Path(__file__).with_name("hardest.json").read_text())


# Drawing


class Problem(NamedTuple):
    """What `Nmpc.solve` takes."""

    state: np.ndarray
    theta: np.ndarray
    action: np.ndarray | None = None

    def solve(self, nmpc: Nmpc, guess: Solution | None = None) -> Solution:
        return nmpc.solve(self.state, self.theta, guess, self.action)


def controller(rng: np.random.Generator, plant: Plant = ROBOT, longest: int = 40) -> Nmpc:
    """A layout, a box, a target, N, gamma and omega; obstacles may lie on each other, or on it."""
    horizon = int(rng.choice([1, 2, 3, 5, 10, min(20, longest), longest]))
    count = int(rng.choice([0, 1, 2, 4, 8, 16]))
    discs = [
        (*rng.uniform(-3, 9, 2), float(rng.choice([2.0, 2.0, 0.5, 4.0, 0.01])))
        for _ in range(count)
    ]
    target = np.append(rng.uniform(-3, 9, 2), np.zeros(plant.n - 2))
    if rng.random() < 0.1:
        target[:2] = -3, 9
    if count and rng.random() < 0.2:
        discs[-1] = discs[0] if rng.random() < 0.5 else (*target[:2], 2.0)
    lower = np.append([-3.0, -3.0], np.full(plant.n - 2, -np.inf))
    upper = np.append([9.0, 9.0], np.full(plant.n - 2, np.inf))
    walls = rng.integers(3)
    if walls == 1:
        lower[0] = -np.inf
    if walls == 2:
        lower[-1], upper[-1] = -4, 4
    task = Task(
        start=target,
        target=target,
        lower=lower,
        upper=upper,
        obstacles=tuple(Obstacle(*disc) for disc in discs),
        weights=np.ones(plant.n),
    )
    gamma, omega = rng.choice([0.97, 0.97, 1.0, 0.9, 0.5]), rng.choice([100.0, 100.0, 1.0, 1e3])
    return Nmpc(plant, task, horizon=horizon, gamma=float(gamma), slack_weight=float(omega))


PLACES = ("box", "obstacle", "edge", "centre", "wall", "corner", "beside", "outside", "target")


def drawn_state(rng: np.random.Generator, nmpc: Nmpc) -> np.ndarray:
    """Anywhere in the box, in and beside an obstacle, on a wall, outside; any heading."""
    place, state = rng.choice(PLACES), rng.uniform(-1.5, 1.5, nmpc.plant.n)
    state[:2] = rng.uniform(-3, 9, 2)
    state[2] *= rng.choice([1.0, 1.0, 70.0])
    if rng.random() < 0.2:
        state[2] = np.pi / 2 * rng.integers(-4, 5)
    if place in ("obstacle", "edge", "centre") and nmpc.task.obstacles:
        x, y, clearance = (one[0] for one in nmpc.task.discs)
        angle, edge = rng.uniform(-np.pi, np.pi), 10 ** rng.uniform(-8, -1) * rng.choice([-1, 1])
        radius = {"obstacle": clearance / 2 * rng.random(), "edge": clearance / 2 + edge}
        state[:2] = np.array([x, y]) + radius.get(place, 0) * np.array(
            [np.cos(angle), np.sin(angle)]
        )
    elif place == "wall":
        state[rng.integers(2)] = rng.choice([-3, 9]) + rng.choice([0, 1e-9, -1e-9, 1e-6, -1e-6])
    elif place == "corner":
        state[:2] = rng.choice([-3, 9], 2)
    elif place == "beside":
        state[rng.integers(2)] = rng.choice([-3, 9]) * (1 + 0.03 * rng.random())
    elif place == "outside":
        state[:2] = rng.uniform(-1, 1, 2) * 10 ** rng.uniform(1.2, 3)
    elif place == "target":
        state = nmpc.task.target.copy()
    return state


SIZES = ("around", "around", "wide", "zeros", "one", "tiny", "none")


def drawn_theta(rng: np.random.Generator, nmpc: Nmpc) -> np.ndarray:
    """Weights from 1e-4 to 1e3, negative and zero ones too; theta_c from -5 to 5."""
    count, size = 2 * nmpc.plant.n + nmpc.plant.m, rng.choice(SIZES)
    theta = 10 ** rng.uniform(-1.3, 0.5, count)
    if size == "wide":
        theta = 10 ** rng.uniform(-4, 3, count)
    elif size == "zeros":
        theta[rng.random(count) < 0.4] = 0
    elif size == "one":
        theta[rng.integers(count)] = 1e3
    elif size == "tiny":
        theta = 10 ** rng.uniform(-4, -3, count)
    elif size == "none" and rng.random() < 0.3:
        theta = np.zeros(count)
    tightened = rng.choice([0, 1e-3, rng.uniform(0, 0.5), rng.uniform(-1, 1), rng.uniform(-5, 5)])
    return np.append(theta * rng.choice([1, 1, 1, -1], count), tightened)


def drawn(rng: np.random.Generator, nmpc: Nmpc) -> Problem:
    """One problem; a third have a fixed action, within its bounds or at them."""
    plant = nmpc.plant
    state, theta, action = drawn_state(rng, nmpc), drawn_theta(rng, nmpc), None
    if rng.random() < 0.3:
        action = rng.uniform(plant.lower, plant.upper)
        if rng.random() < 0.3:
            action = np.where(rng.random(plant.m) < 0.5, plant.lower, plant.upper)
    return Problem(state, theta, action)


# Judging


@cache
def conditions(ocp: Ocp) -> ca.Function:
    """Objective, constraints, and the Lagrangian's gradients in z and theta, of (z, p, lam)."""
    value, lam = lagrangian(ocp)
    slopes = [ca.gradient(value, ocp.variables), ca.gradient(value, ocp.theta)]
    arguments = [ocp.variables, ocp.parameters, lam]
    return ca.Function("conditions", arguments, [ocp.objective, ocp.constraints, *slopes])


def parameters(solution: Solution) -> np.ndarray:
    """p = (s, theta[, a])."""
    fixed = solution.action[: solution.ocp.fixed_action.size]
    return np.concatenate([solution.state, solution.theta, fixed])


def unit(theta: np.ndarray) -> float:
    """What the solver divides costs by, so that no weight exceeds 1."""
    return max(1.0, (theta**2).max())


def sides(solution: Solution) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of every bound: how far it is exceeded, its multiplier, and whether it is one of the box."""
    ocp, z, nu = solution.ocp, solution.primal, solution.bound_duals
    of_box = np.zeros(z.size, bool)
    of_box[ocp.states] = True
    excess = np.concatenate([ocp.lower - z, z - ocp.upper])
    multiplier = np.concatenate([np.maximum(-nu, 0), np.maximum(nu, 0)])
    return excess, multiplier, np.tile(of_box, 2)


def box_weight(solution: Solution) -> float:
    """What a unit beyond the box costs: the multiplier of whatever is beyond it."""
    excess, multiplier, of_box = sides(solution)
    return multiplier[np.argmax(np.where(of_box, excess, -np.inf))]


def residual(solution: Solution) -> float:
    """The largest violation of the KKT conditions of Eq. (2) with the box as a penalty.

    Stationarity is relative to the largest multiplier; of a multiplier and its distance, the
    product counts, in the unit of the costs.
    """
    scale, weight = unit(solution.theta), box_weight(solution)
    z, lam, nu = solution.primal, solution.constraint_duals, solution.bound_duals
    parts = conditions(solution.ocp)(z, parameters(solution), lam)
    _, g, slope, _ = (part.full().ravel() for part in parts)
    equality = solution.ocp.equality
    excess, multiplier, of_box = sides(solution)
    inside = np.where(multiplier > 0, multiplier * np.minimum(excess, 0), 0)
    outside = np.where(of_box & (excess > 0), (weight - multiplier) * excess, 0)
    length = np.abs(solution.states).max(initial=1)
    violations = (
        (slope + nu) / max(scale, np.abs(lam).max(), np.abs(nu).max()),
        g[equality] / length,
        np.maximum(g[~equality], 0) / length**2,
        np.minimum(lam[~equality], 0) / scale,
        (lam * g)[~equality] / scale,
        inside / scale,
        outside / scale,
        np.where(of_box, 0, np.maximum(excess, 0)),
    )
    return float(max(np.abs(violation).max(initial=0) for violation in violations))


def beyond(solution: Solution) -> np.ndarray:
    """How far the predicted states leave the box."""
    excess, _, of_box = sides(solution)
    return np.maximum(excess[of_box], 0)
