"""riccati on a thousand drawn problems, most of them far from what learning visits.

The problem it solves is Eq. (2) with the box as a penalty, so there is always a solution. Here that
problem is written with CasADi: its KKT conditions, and an Ipopt that solves it to 1e-10.
"""

import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
from nmpcrl.control.solvers.starts import random_inputs

ROBOT = differential_drive()
KKT = 3e-8  # left of the conditions, each in its own unit: see `residual`; the solver allows 1e-8
HARDEST = json.loads(Path(__file__).with_name("hardest.json").read_text())


# Drawing


class Problem(NamedTuple):
    """What `Nmpc.solve` takes."""

    state: np.ndarray
    theta: np.ndarray
    action: np.ndarray | None = None

    def solve(self, nmpc: Nmpc, warm_start: Solution | None = None) -> Solution:
        return nmpc.solve(self.state, self.theta, warm_start, self.action)


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


def unit(theta: np.ndarray) -> float:
    """What the solver divides costs by, so that no weight exceeds 1."""
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


def residual(solution: Solution) -> float:
    """The largest violation of the KKT conditions of Eq. (2) with the box as a penalty.

    Stationarity is relative to the largest multiplier; of a multiplier and its distance, the
    product counts, in the unit of the costs.
    """
    scale, weight = unit(solution.theta), box_weight(solution)
    z, lam, nu = solution.primal, solution.constraint_duals, solution.bound_duals
    parts = conditions(solution.ocp)(z, solution.parameters, lam)
    _, g, slope, _ = (part.full().ravel() for part in parts)
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


def beyond(solution: Solution) -> np.ndarray:
    """How far the predicted states leave the box."""
    beyond, _, of_box = sides(solution)
    return np.maximum(beyond[of_box], 0)


@cache
def penalised(ocp: Ocp) -> tuple[ca.Function, dict[str, np.ndarray]]:
    """Ipopt on Eq. (2) with the box as a penalty, and its bounds; the last parameter is W."""
    box = np.zeros(ocp.lower.size, bool)
    box[ocp.states[1:]] = True
    z, weight = ocp.variables, ca.SX.sym("weight")
    over = [(-1, a, ocp.lower[a]) for a in np.flatnonzero(box & np.isfinite(ocp.lower))]
    over += [(1, a, ocp.upper[a]) for a in np.flatnonzero(box & np.isfinite(ocp.upper))]
    t = ca.SX.sym("t", len(over))
    left = [sign * (z[int(a)] - limit) - t[i] for i, (sign, a, limit) in enumerate(over)]
    nlp = {
        "x": ca.vertcat(z, t),
        "p": ca.vertcat(ocp.parameters, weight),
        "f": ocp.objective + weight * ca.sum1(t),
        "g": ca.vertcat(ocp.constraints, *left),
    }
    exact = {"print_level": 0, "sb": "yes", "tol": 1e-10, "max_iter": 1000}
    exact |= {"max_wall_time": 10.0, "bound_relax_factor": 0.0, "acceptable_iter": 0}
    bounds = {
        "lbx": np.append(np.where(box, -np.inf, ocp.lower), np.zeros(len(over))),
        "ubx": np.append(np.where(box, np.inf, ocp.upper), np.full(len(over), np.inf)),
        "lbg": np.append(np.where(ocp.equality, 0, -np.inf), np.full(len(over), -np.inf)),
        "ubg": np.zeros(ocp.equality.size + len(over)),
    }
    return ca.nlpsol("penalised", "ipopt", nlp, {"print_time": False, "ipopt": exact}), bounds


def total(solution: Solution) -> float:
    """The value and what the box charges."""
    return solution.value + box_weight(solution) * beyond(solution).sum()


def ipopts(solution: Solution, inputs: np.ndarray | float = 0.0) -> tuple[float, np.ndarray] | None:
    """Ipopt's `total` and states for the same problem, from these inputs; None if it fails."""
    ocp = solution.ocp
    solver, bounds = penalised(ocp)
    z = np.zeros(ocp.lower.size)
    z[ocp.states], z[ocp.inputs] = solution.state, inputs
    weight = box_weight(solution) if solution.violation > 1e-6 else 1e4 * unit(solution.theta)
    start = np.append(z, np.zeros(bounds["lbx"].size - z.size))
    found = solver(x0=start, p=np.append(solution.parameters, weight), **bounds)
    if not solver.stats()["success"]:
        return None
    return float(found["f"]), found["x"].full().ravel()[ocp.states]


def judged(nmpc: Nmpc, solution: Solution) -> None:
    """Everything that holds for whatever is called solved."""
    plant = nmpc.plant
    assert np.isfinite([solution.value, solution.violation]).all()
    assert np.isfinite(solution.point).all()
    assert np.isfinite(solution.features).all()
    assert (plant.lower <= solution.inputs).all()
    assert (solution.inputs <= plant.upper).all()
    assert solution.violation == pytest.approx(beyond(solution).max(initial=0), abs=1e-9)
    assert residual(solution) <= KKT
    arguments = solution.primal, solution.parameters, solution.constraint_duals
    value, _, _, features = conditions(solution.ocp)(*arguments)
    assert solution.value == pytest.approx(float(value), rel=1e-9, abs=1e-12)
    scale = np.abs(features.full()).max(initial=1)
    np.testing.assert_allclose(solution.features, features.full().ravel(), atol=1e-9 * scale)


# A thousand problems


@pytest.fixture(scope="module")
def mass(point_mass) -> Plant:
    """Another plant: linear, with four states."""
    return point_mass(bound=2.0)


@pytest.mark.weekly
@pytest.mark.slow
@pytest.mark.parametrize(("name", "layouts", "failures"), [("robot", 16, 4), ("mass", 6, 3)])
def test_of_a_thousand_problems_nearly_all_are_solved_and_none_wrongly(
    name, layouts, failures, mass
):
    """About one in a thousand is given up, and says so; `nmpcrl bench --sweep` tries 100,000."""
    ended = {"failed": 0, "restarted": 0}
    for layout in range(layouts):
        rng = np.random.default_rng([1, layout])
        nmpc = controller(rng, ROBOT if name == "robot" else mass)
        for _ in range(50):
            problem = drawn(rng, nmpc)
            try:
                solution = problem.solve(nmpc)
            except SolverError:
                ended["failed"] += 1
                continue
            judged(nmpc, solution)
            ended["restarted"] += solution.status == "restarted"
    assert ended["failed"] <= failures
    assert ended["restarted"] <= 12


@pytest.mark.slow
def test_values_are_ipopts_or_those_of_another_minimum():
    """Compared with a problem that tolerates the box being left; at most 3 % are worse."""
    compared, elsewhere, worse = 0, 0, 0
    for layout in range(24):
        rng = np.random.default_rng([2, layout])
        nmpc = controller(rng, longest=10)
        for _ in range(10):
            problem = drawn(rng, nmpc)
            solution = problem.solve(nmpc)
            found = ipopts(solution)
            if found is None:
                continue
            compared += 1
            value, states = found
            allowed = 1e-6 * abs(value) + 1e-7 * unit(problem.theta)
            if abs(total(solution) - value) <= allowed:
                continue
            elsewhere += 1
            if total(solution) > value:
                worse += 1
                assert np.abs(solution.states - states).max() > 1e-2  # elsewhere, not inexact
    assert compared >= 200
    assert elsewhere <= 0.15 * compared  # mostly better ones
    assert worse <= 0.03 * compared


def worse_than_ipopts_best(layouts: range, starts: tuple[int, ...]) -> tuple[int, dict[int, int]]:
    """How many cold solves, and of those with so many starts, how many are 0.1 % above Ipopt.

    The best of ten: from standing still, and nine times from other inputs.
    """
    compared, worse = 0, dict.fromkeys(starts, 0)
    for layout in layouts:
        rng = np.random.default_rng([5, layout])
        nmpc = controller(rng)
        solvers = {
            k: Nmpc(
                nmpc.plant,
                nmpc.task,
                horizon=nmpc.horizon,
                gamma=nmpc.gamma,
                slack_weight=nmpc.slack_weight,
                solver=Riccati(starts=k),
            )
            for k in starts
        }
        for _ in range(10):
            problem = drawn(rng, nmpc)
            try:
                found = {k: problem.solve(one) for k, one in solvers.items()}
            except SolverError:
                continue
            standing = found[starts[0]]
            if standing.violation > 1e-6:
                continue
            others = [random_inputs(ROBOT, seed, nmpc.horizon) for seed in range(20, 29)]
            values = [one[0] for u in (0.0, *others) if (one := ipopts(standing, u))]
            if not values:
                continue
            compared += 1
            for k, solution in found.items():
                worse[k] += solution.value - min(values) > 1e-3 * max(abs(min(values)), 1e-6)
    return compared, worse


@pytest.mark.weekly
@pytest.mark.slow
def test_nine_cold_starts_leave_few_worse_plans_than_ten_of_ipopts():
    compared, worse = worse_than_ipopts_best(range(4), starts=(1, 9))
    assert compared >= 20
    assert worse[9] <= 0.03 * compared
    assert worse[9] <= worse[1]


@pytest.mark.slow
def test_inside_the_box_the_solution_is_that_of_the_hard_box(controllers, draw):
    same = worse = 0
    for state, theta in draw(100, seed=40):
        solution = controllers["riccati"].solve(state, theta)
        assert solution.violation <= 1e-6
        ipopt = controllers["ipopt"].solve(state, theta)
        if solution.value != pytest.approx(ipopt.value, rel=1e-6):
            assert np.abs(solution.states - ipopt.states).max() > 1e-2
            worse += solution.value > ipopt.value
            continue
        same += 1
        scale = np.abs(ipopt.features).max()
        np.testing.assert_allclose(solution.features, ipopt.features, atol=1e-5 * scale)
    assert same >= 85  # of the others, several starts find lower minima than Ipopt's one
    assert worse <= 2


@pytest.mark.weekly
@pytest.mark.slow
def test_from_the_same_warm_start_no_more_than_one_in_two_hundred_is_worse_than_ipopts():
    """After a step, after a noisy one, and after a change of theta."""
    compared, worse = 0, 0
    for layout in range(24):
        rng = np.random.default_rng([3, layout])
        nmpc = controller(rng, longest=10)
        ipopt = Nmpc(
            nmpc.plant,
            nmpc.task,
            horizon=nmpc.horizon,
            gamma=nmpc.gamma,
            slack_weight=nmpc.slack_weight,
            solver="ipopt",
        )
        for _ in range(8):
            state, theta = drawn_state(rng, nmpc), drawn_theta(rng, nmpc)
            warm_start = nmpc.solve(state, theta)
            noisy = ROBOT.clip(warm_start.action + rng.normal(scale=0.3, size=2))
            for after, weights in (
                (ROBOT.step(state, warm_start.action), theta),
                (ROBOT.step(state, noisy), theta),
                (state, theta * rng.uniform(0.95, 1.05, 9)),
            ):
                try:
                    other = ipopt.solve(after, weights, warm_start)
                except SolverError:  # the state lies outside the box
                    continue
                value = nmpc.solve(after, weights, warm_start).value
                compared += 1
                worse += value > other.value * (1 + 1e-6) + 1e-7 * unit(weights)
    assert compared >= 250
    assert worse <= 0.005 * compared


@pytest.mark.slow
def test_features_are_the_differences_of_the_value_away_from_kinks():
    """Along drawn directions; a solve that falls into another minimum shows in the curvature."""
    compared, jumped, step = 0, 0, 1e-4
    for layout in range(20):
        rng = np.random.default_rng([4, layout])
        nmpc = controller(rng, longest=10)
        for _ in range(10):
            problem = drawn(rng, nmpc)
            beyond = nmpc.task.overlap(problem.state) + problem.theta[-1]
            if np.abs(beyond).min(initial=1) < 1e-2:
                continue
            solution = problem.solve(nmpc)
            if solution.violation > 1e-6:  # then the features are those of `total`
                continue
            along = rng.normal(size=9) * np.maximum(np.abs(problem.theta), 1e-2)
            above, below = (
                problem._replace(theta=problem.theta + d).solve(nmpc, solution).value
                for d in (step * along, -step * along)
            )
            slope, size = (above - below) / (2 * step), abs(solution.features) @ abs(along)
            bend = (above - 2 * solution.value + below) / step
            if abs(bend) > 0.05 * size + 1e-6 * unit(problem.theta):
                jumped += 1
                continue
            compared += 1
            exact = solution.features @ along
            assert slope == pytest.approx(exact, abs=1e-5 * size + 1e-5 * unit(problem.theta))
    assert compared >= 100
    assert jumped <= 6


# Whatever hypothesis thinks of

coordinate, weight = st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)
problems = st.builds(
    Problem,
    state=st.tuples(coordinate, coordinate, st.floats(-100, 100)).map(np.array),
    theta=st.tuples(*[weight] * 8, st.floats(-5, 5)).map(np.array),
    action=st.none() | st.tuples(st.floats(-0.6, 0.6), st.floats(-1.5, 1.5)).map(np.array),
)
typical = st.builds(
    Problem,
    state=st.tuples(st.floats(-3, 9), st.floats(-3, 9), st.floats(-4, 4)).map(np.array),
    theta=st.tuples(*[st.floats(0.1, 2)] * 8, st.floats(-0.3, 0.3)).map(np.array),
    action=st.none(),
)
LAYOUTS = [controller(np.random.default_rng([5, layout])) for layout in range(30)]


@pytest.mark.slow
def test_whatever_is_asked_the_answer_is_a_solution_and_seldom_an_error():
    ended = {"solved": 0, "failed": 0}

    @settings(derandomize=True, deadline=None, max_examples=400)
    @given(problem=problems | typical, nmpc=st.sampled_from(LAYOUTS))
    def ask(problem, nmpc):
        try:
            solution = problem.solve(nmpc)
        except SolverError:
            ended["failed"] += 1
            return
        judged(nmpc, solution)
        ended["solved"] += 1

    ask()
    assert ended["failed"] <= 0.1 * ended["solved"]


def mirrored(nmpc: Nmpc) -> Nmpc:
    """The same world with y for -y."""
    task, mirror = nmpc.task, np.array([1.0, -1.0, -1.0])
    lower, upper = np.sort([task.lower * mirror, task.upper * mirror], axis=0)
    other = Task(
        start=task.start * mirror,
        target=task.target * mirror,
        lower=lower,
        upper=upper,
        obstacles=tuple(Obstacle(one.x, -one.y, one.diameter) for one in task.obstacles),
    )
    return Nmpc(
        nmpc.plant,
        other,
        horizon=nmpc.horizon,
        gamma=nmpc.gamma,
        slack_weight=nmpc.slack_weight,
    )


PAIRS = [(one, mirrored(one)) for one in LAYOUTS if one.horizon <= 10]


@settings(derandomize=True, deadline=None, max_examples=100)
@given(problem=typical, pair=st.sampled_from(PAIRS))
def test_a_mirrored_world_has_mirrored_plans(problem, pair):
    mirror = np.array([1.0, -1.0, -1.0])
    one = problem.solve(pair[0])
    other = problem._replace(state=problem.state * mirror).solve(pair[1])
    assert other.value == pytest.approx(one.value, rel=1e-6, abs=1e-7)
    np.testing.assert_allclose(other.states[-1] * mirror, one.states[-1], atol=1e-2)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(problem=typical, nmpc=st.sampled_from(LAYOUTS))
def test_solving_again_from_the_solution_costs_an_iteration_or_two(problem, nmpc):
    solution = problem.solve(nmpc)
    again = problem.solve(nmpc, solution)
    assert again.iterations <= 4
    assert again.value == pytest.approx(solution.value, rel=1e-6, abs=1e-7)


# The hardest that were found


def remembered(case: dict, mass: Plant) -> tuple[Nmpc, Problem]:
    lower, upper = (
        np.array([sign * np.inf if v is None else v for v in case[side]])
        for side, sign in (("lower", -1), ("upper", 1))
    )
    task = Task(
        start=np.array(case["target"]),
        target=np.array(case["target"]),
        lower=lower,
        upper=upper,
        obstacles=tuple(Obstacle(*disc) for disc in case["obstacles"]),
        weights=np.ones(lower.size),
    )
    nmpc = Nmpc(
        ROBOT if lower.size == 3 else mass,
        task,
        horizon=case["horizon"],
        gamma=case["gamma"],
        slack_weight=case["slack_weight"],
    )
    action = None if case["action"] is None else np.array(case["action"])
    return nmpc, Problem(np.array(case["state"]), np.array(case["theta"]), action)


@pytest.mark.slow
@pytest.mark.parametrize("case", HARDEST, ids=lambda case: case["why"])
def test_the_hardest_problems_stay_solved(case, mass):
    """No worse than when they were recorded: two were minima 4 and 5 % above Ipopt's even then."""
    nmpc, problem = remembered(case, mass)
    try:
        solution = problem.solve(nmpc)
    except SolverError:
        assert case["value"] is None  # known to be given up, at least on some machines
        return
    judged(nmpc, solution)
    assert solution.violation <= case["violation"] + 1e-6
    if case["value"] is not None:
        allowed = 1e-6 * abs(case["value"]) + 1e-9 * unit(problem.theta)
        assert total(solution) <= case["value"] + allowed
