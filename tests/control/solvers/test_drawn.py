"""riccati on a thousand drawn problems, most of them far from what learning visits.

The problem it solves is Eq. (2) with the box as a penalty, so there is always a solution. Here its
KKT conditions are written with CasADi.
"""

import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest
from small_problems import point_mass

from nmpcrl.control import (
    Nmpc,
    Obstacle,
    Plant,
    Riccati,
    Solution,
    SolverError,
    Task,
    differential_drive,
)
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.sensitivity import lagrangian
from nmpcrl.control.solvers.stages import STEEP

ROBOT, MASS = differential_drive(), point_mass(bound=2.0)  # the mass is linear, with four states
KKT = 2e-8  # left of the conditions in their units, see `residual`: mu and its error, 1e-8 each
HARDEST = json.loads(Path(__file__).with_name("hardest.json").read_text())


# Drawing


class Problem(NamedTuple):
    """What `Nmpc.solve` takes."""

    state: np.ndarray
    theta: np.ndarray
    action: np.ndarray | None = None

    def solve(self, nmpc: Nmpc, warm_start: Solution | None = None) -> Solution:
        return nmpc.solve(self.state, self.theta, warm_start, self.action)


def world(plant: Plant, target, lower, upper, discs, *how) -> Nmpc:
    """A controller; `how` are horizon, gamma and omega."""
    obstacles = tuple(Obstacle(*disc) for disc in discs)
    task = Task(target, target, lower, upper, obstacles, weights=np.ones(plant.n))
    return Nmpc(plant, task, *how)


def like(nmpc: Nmpc, solver: Riccati | str) -> Nmpc:
    """The same controller with another solver."""
    how = nmpc.horizon, nmpc.gamma, nmpc.slack_weight
    return Nmpc(nmpc.plant, nmpc.task, *how, solver=solver)


def controller(rng: np.random.Generator, plant: Plant = ROBOT, longest: int = 40) -> Nmpc:
    """A layout, a box, a target, N, gamma and omega; obstacles may lie on each other, or on it."""
    horizon = int(rng.choice([1, 2, 3, 5, 10, min(20, longest), longest]))
    count = int(rng.choice([0, 1, 2, 4, 8, 16]))
    diameters = [2.0, 2.0, 0.5, 4.0, 0.01]
    discs = [(*rng.uniform(-3, 9, 2), float(rng.choice(diameters))) for _ in range(count)]
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
    gamma, omega = rng.choice([0.97, 0.97, 1.0, 0.9, 0.5]), rng.choice([100.0, 100.0, 1.0, 1e3])
    return world(plant, target, lower, upper, discs, horizon, float(gamma), float(omega))


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
        away = radius.get(place, 0)
        state[:2] = x + away * np.cos(angle), y + away * np.sin(angle)
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
    """Objective and its steepest slope, constraints, and the Lagrangian's gradients in z, theta."""
    value, lam = lagrangian(ocp)
    slope = ca.gradient(ocp.objective, ocp.variables)[ocp.states.ravel().tolist()]
    found = [ocp.objective, ca.norm_inf(slope), ocp.constraints]
    found += [ca.gradient(value, ocp.variables), ca.gradient(value, ocp.theta)]
    return ca.Function("conditions", [ocp.variables, ocp.parameters, lam], found)


def unit(theta: np.ndarray) -> float:
    """The largest weight of the costs, and at least 1."""
    return max(1.0, (theta**2).max())


def sides(solution: Solution) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of every bound: how far it is exceeded, its multiplier, and whether it is one of the box."""
    ocp, z, nu = solution.ocp, solution.primal, solution.bound_duals
    of_box = np.zeros(z.size, bool)
    of_box[ocp.states] = True
    beyond = np.concatenate([ocp.lower - z, z - ocp.upper])
    multiplier = np.concatenate([np.maximum(-nu, 0), np.maximum(nu, 0)])
    return beyond, multiplier, np.tile(of_box, 2)


def box_weight(solution: Solution) -> float:
    """What a unit beyond the box costs: the multiplier of whatever is beyond it."""
    beyond, multiplier, of_box = sides(solution)
    return multiplier[np.argmax(np.where(of_box, beyond, -np.inf))]


def beyond(solution: Solution) -> np.ndarray:
    """How far the predicted states leave the box."""
    beyond, _, of_box = sides(solution)
    return np.maximum(beyond[of_box], 0)


def judged(nmpc: Nmpc, solution: Solution) -> None:
    """Everything that holds for whatever is called solved."""
    arguments = solution.primal, solution.parameters, solution.constraint_duals
    parts = (part.full().ravel() for part in conditions(solution.ocp)(*arguments))
    (value,), (steepest,), g, slope, features = parts
    assert np.isfinite([solution.value, solution.violation, *solution.point]).all()
    assert (nmpc.plant.lower <= solution.inputs).all()
    assert (solution.inputs <= nmpc.plant.upper).all()
    assert solution.violation == pytest.approx(beyond(solution).max(initial=0), abs=1e-9)
    assert residual(solution, steepest, g, slope) <= KKT
    assert solution.value == pytest.approx(value, rel=1e-9, abs=1e-12)
    scale = np.abs(features).max(initial=1)
    np.testing.assert_allclose(solution.features, features, rtol=0, atol=1e-9 * scale)


def residual(solution: Solution, steepest: float, g: np.ndarray, slope: np.ndarray) -> float:
    """The largest violation of the KKT conditions of Eq. (2) with the box as a penalty.

    Stationarity is relative to the largest multiplier; of a multiplier and its distance, the
    product counts, in the unit by which `kernel.scale` divides the costs.
    """
    scale, weight = max(unit(solution.theta), steepest / STEEP), box_weight(solution)
    lam, nu = solution.constraint_duals, solution.bound_duals
    equality = solution.ocp.equality
    beyond, multiplier, of_box = sides(solution)
    multiplier[solution.ocp.slacks[0]] = 0  # nothing is planned about them  # departure L
    with np.errstate(invalid="ignore"):  # infinite bounds
        inside = np.where(multiplier > 0, multiplier * np.minimum(beyond, 0), 0)
        outside = np.where(of_box & (beyond > 0), (weight - multiplier) * beyond, 0)
    length = np.abs(solution.states).max(initial=1)
    violations = (
        (slope + nu) / max(scale, np.abs(lam).max(), np.abs(nu).max()),
        g[equality] / length,
        np.maximum(g[~equality], 0) / length**2,
        np.minimum(lam[~equality], 0) / scale,
        (lam * g)[~equality] / scale,
        inside / scale,
        outside / scale,
        np.where(of_box, 0, np.maximum(beyond, 0)),
    )
    return float(max(np.abs(violation).max(initial=0) for violation in violations))


# A thousand problems


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plant", "layouts", "failures"), [(ROBOT, 16, 4), (MASS, 6, 3)], ids=["robot", "mass"]
)
def test_of_a_thousand_problems_nearly_all_are_solved_and_none_wrongly(plant, layouts, failures):
    """About one in a thousand is given up, and says so."""
    failed = restarted = 0
    for layout in range(layouts):
        rng = np.random.default_rng([1, layout])
        nmpc = controller(rng, plant)
        for _ in range(50):
            problem = drawn(rng, nmpc)
            try:
                solution = problem.solve(nmpc)
            except SolverError:
                failed += 1
                continue
            judged(nmpc, solution)
            restarted += solution.status == "restarted"
    assert failed <= failures
    assert restarted <= 12


@pytest.mark.weekly
@pytest.mark.slow
def test_values_are_ipopts_or_those_of_another_minimum():
    """Cold ones; and warm ones, after a step, after a noisy one, and after a change of theta."""
    cold, warm = [], []
    for layout in range(24):
        rng = np.random.default_rng([3, layout])
        nmpc = controller(rng, longest=10)
        ipopt = like(nmpc, solver="ipopt")
        for _ in range(8):
            state, theta = drawn_state(rng, nmpc), drawn_theta(rng, nmpc)
            first = nmpc.solve(state, theta)
            noisy = ROBOT.clip(first.action + rng.normal(scale=0.3, size=2))
            for after, weights, start in (
                (state, theta, None),
                (ROBOT.step(state, first.action), theta, first),
                (ROBOT.step(state, noisy), theta, first),
                (state, theta * rng.uniform(0.95, 1.05, 9), first),
            ):
                try:
                    other = ipopt.solve(after, weights, start)
                except SolverError:  # the state lies outside the box
                    continue
                solution = nmpc.solve(after, weights, start)
                above = solution.value - other.value
                if abs(above) <= 1e-6 * abs(other.value) + 1e-7 * unit(weights):
                    above = 0.0
                apart = np.abs(solution.states - other.states).max()
                assert start or above <= 0 or apart > 1e-2  # elsewhere, not inexact
                (warm if start else cold).append(above)
    assert len(cold) >= 80
    assert np.not_equal(cold, 0).mean() <= 0.15  # mostly better ones
    assert np.greater(cold, 0).mean() <= 0.03
    assert len(warm) >= 250
    assert np.greater(warm, 0).mean() <= 0.005


# The hardest that were found


def remembered(case: dict) -> tuple[Nmpc, Problem]:
    lower, upper = (
        np.nan_to_num(np.array(case[side], float), nan=free)
        for side, free in (("lower", -np.inf), ("upper", np.inf))
    )
    plant, how = ROBOT if lower.size == 3 else MASS, ("horizon", "gamma", "slack_weight")
    target, discs = np.array(case["target"]), case["obstacles"]
    nmpc = world(plant, target, lower, upper, discs, *(case[name] for name in how))
    action = None if case["action"] is None else np.array(case["action"])
    return nmpc, Problem(np.array(case["state"]), np.array(case["theta"]), action)


@pytest.mark.slow
@pytest.mark.parametrize("case", HARDEST, ids=lambda case: case["why"])
def test_the_hardest_problems_stay_solved(case):
    """No worse than when they were recorded: two were minima 4 and 5 % above Ipopt's even then."""
    nmpc, problem = remembered(case)
    try:
        solution = problem.solve(nmpc)
    except SolverError:
        assert case["value"] is None  # known to be given up, at least on some machines
        return
    judged(nmpc, solution)
    assert solution.violation <= case["violation"] + 1e-6
    if case["value"] is not None:
        allowed = 1e-6 * abs(case["value"]) + 1e-9 * unit(problem.theta)
        total = solution.value + box_weight(solution) * beyond(solution).sum()
        assert total <= case["value"] + allowed
