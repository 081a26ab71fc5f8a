"""A box that may be left for a price, against the same problem with slacks in Ipopt."""

from collections.abc import Iterator

import casadi as ca
import numpy as np
import pytest

from nmpcrl import Vector
from nmpcrl.control import Ipopt, Nmpc, Riccati, Solution, Task, differential_drive
from nmpcrl.control.codegen import jit
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
START = np.array(paper.START)
H, GAMMA = 0.2, 0.9


def soft(
    omega: float = 100.0, upper: float = 9.0, horizon: int = 6, soft_box=True, **options
) -> Nmpc:
    """The paper's controller with another price and place of the upper walls."""
    task = paper.task()
    walls = Task(
        task.start,
        task.target,
        task.lower,
        np.array([upper, upper, 2.5]),
        task.obstacles,
        soft_box=soft_box,
        target_may_lie_outside=True,
    )
    return Nmpc(differential_drive(), walls, horizon=horizon, slack_weight=omega, **options)


def beyond(nmpc: Nmpc, solution: Solution) -> np.ndarray:
    """How far x_1, ..., x_N leave the box, shape (N, n)."""
    later, task = solution.states[1:], nmpc.task
    return np.maximum(np.maximum(later - task.upper, task.lower - later), 0)


def with_slacks(nmpc: Nmpc, solution: Solution) -> tuple[float, Vector]:
    """Ipopt's value and its derivative in theta, where each side of the box has slacks.

    The inputs and slacks are variables and the states follow. Started from the plan of `solution`,
    or the two might be compared at different minima.
    """
    plant, task, N, omega = nmpc.plant, nmpc.task, nmpc.horizon, nmpc.slack_weight
    n, m, M = plant.n, plant.m, len(task.obstacles)
    walls = [(k, 1, task.upper[k]) for k in np.flatnonzero(np.isfinite(task.upper)).tolist()]
    walls += [(k, -1, task.lower[k]) for k in np.flatnonzero(np.isfinite(task.lower)).tolist()]
    u, sigma = ca.SX.sym("u", m, N), ca.SX.sym("sigma", M, N + 1)
    left, theta = ca.SX.sym("left", len(walls), N), ca.SX.sym("theta", 2 * n + m + 1)
    x, value, g, start = ca.SX(solution.state), ca.SX(0), [], []
    for i in range(N + 1):
        for j, obstacle in enumerate(task.obstacles):
            away = (x[0] - obstacle.x) ** 2 + (x[1] - obstacle.y) ** 2
            inside = 1 - 4 * away / (task.robot_diameter + obstacle.diameter) ** 2
            g.append(inside + theta[-1] - sigma[j, i])
        price = omega * ca.sum1(sigma[:, i])
        if i > 0:
            g += [sign * (x[k] - wall) - left[t, i - 1] for t, (k, sign, wall) in enumerate(walls)]
            price += omega * ca.sum1(left[:, i - 1])
            reached = [sign * (solution.states[i, k] - wall) for k, sign, wall in walls]
            start += np.maximum(reached, 0).tolist()
        error = x - task.target
        if i < N:
            cost = ca.sumsqr(theta[:n] * error) + ca.sumsqr(theta[n : n + m] * u[:, i])
            x = plant.transition(x, u[:, i])
        else:
            cost = ca.sumsqr(theta[n + m : -1] * error)
        value += nmpc.gamma**i * (cost + price)
    z = ca.veccat(u, sigma, left)
    lower = np.concatenate([np.tile(plant.lower, N), np.zeros(sigma.numel() + left.numel())])
    upper = np.concatenate([np.tile(plant.upper, N), np.full(sigma.numel() + left.numel(), np.inf)])
    nlp = {"x": z, "p": theta, "f": value, "g": ca.vertcat(*g)}
    precise = {"print_level": 0, "sb": "yes", "tol": 1e-10, "bound_relax_factor": 0.0}
    ipopt = ca.nlpsol("ipopt", "ipopt", nlp, {"print_time": False, "ipopt": precise})
    plan = [solution.inputs.ravel(), solution.slacks.ravel(), start]
    found = ipopt(x0=np.concatenate(plan), p=solution.theta, lbx=lower, ubx=upper, ubg=0)
    assert ipopt.stats()["success"]
    return float(found["f"]), -found["lam_p"].full().ravel()


def drawn(nmpc: Nmpc, count: int, seed: int) -> Iterator[Solution]:
    """Solutions near the upper walls, on either side of them, and not on an obstacle's edge."""
    rng, wall = np.random.default_rng(seed), nmpc.task.upper[0]
    while count:
        state = rng.uniform([wall - 0.5, wall - 6, -2], [wall + 0.5, wall + 0.3, 3])
        theta = THETA * rng.uniform(0.5, 2, 9)
        if np.abs(nmpc.task.overlap(state) + theta[-1]).min() > 1e-2:
            count -= 1
            yield nmpc.solve(state, theta)


@pytest.mark.slow
@pytest.mark.parametrize(("omega", "upper"), [(100.0, 9.0), (100.0, 6.0), (3.0, 6.0)])
def test_value_and_features_are_those_of_ipopt_with_slacks(omega, upper):
    nmpc, left = soft(omega, upper), 0
    for solution in drawn(nmpc, 12, seed=60):
        value, features = with_slacks(nmpc, solution)
        assert solution.value == pytest.approx(value, rel=1e-7)
        scale = np.abs(features).max()
        np.testing.assert_allclose(solution.features, features, atol=1e-5 * scale)
        left += solution.violation > 1e-3
    assert left >= 4


def test_the_value_is_what_the_plan_costs_and_what_leaving_the_box_costs():
    """Eq. (2a) along the plan, and omega gamma^i for every metre outside in stage i."""
    nmpc = soft(3.0, 6.0)
    for solution in drawn(nmpc, 12, seed=61):
        theta, discount = solution.theta, nmpc.gamma ** np.arange(nmpc.horizon + 1)
        error = solution.states - nmpc.task.target
        costs = ((theta[:3] * error) ** 2).sum(axis=1)
        costs[:-1] += ((theta[3:5] * solution.inputs) ** 2).sum(axis=1)
        costs[-1] = ((theta[5:8] * error[-1]) ** 2).sum()
        costs += 3.0 * np.maximum(nmpc.task.overlap(solution.states) + theta[8], 0).sum(axis=1)
        costs[1:] += 3.0 * beyond(nmpc, solution).sum(axis=1)
        assert solution.value == pytest.approx(discount @ costs, rel=1e-9)


def test_a_plan_that_leaves_the_box_is_optimal_and_says_how_far_it_is_left():
    nmpc, left = soft(3.0, 6.0), 0
    for solution in drawn(nmpc, 12, seed=62):
        furthest = beyond(nmpc, solution).max()
        assert solution.violation == pytest.approx(furthest, abs=1e-9)
        assert nmpc.kkt_residual(solution) < 1e-5
        assert nmpc.kkt_residual(solution, relative=True) < 1e-5
        left += furthest > 1e-2
    assert left >= 4


def test_features_are_the_differences_of_the_value_outside_the_box_too():
    """Of a hard box they are not: there `value` leaves out what the box charges."""
    nmpc, step, compared = soft(3.0, 6.0), 1e-4, 0
    for solution in drawn(nmpc, 12, seed=63):
        along = THETA * np.linspace(-1, 1, 9)
        above, below = (
            nmpc.solve(solution.state, solution.theta + d, solution).value
            for d in (step * along, -step * along)
        )
        bend = abs(above - 2 * solution.value + below) / step
        size = np.abs(along) @ np.abs(solution.features)
        if bend > 0.05 * size:  # fell into another minimum
            continue
        assert (above - below) / (2 * step) == pytest.approx(
            solution.features @ along, abs=1e-5 * size
        )
        compared += solution.violation > 1e-3
    assert compared >= 4


def test_the_product_with_the_hessian_is_the_difference_of_the_features_outside_too():
    nmpc, step, compared = soft(3.0, 6.0, solver=Riccati(tolerance=1e-11)), 1e-5, 0
    for solution in drawn(nmpc, 16, seed=64):
        along = THETA * np.linspace(-1, 1, 9)
        slopes = []
        for length in (step, 2 * step):
            above, below = (
                nmpc.solve(solution.state, solution.theta + d, solution).features
                for d in (length * along, -length * along)
            )
            slopes.append((above - below) / (2 * length))
        scale = np.abs(slopes[0]).max()
        if np.abs(slopes[0] - slopes[1]).max() > 1e-5 * scale:  # a kink lies between
            continue
        for product in (
            nmpc.value_hessian_times(solution, along), nmpc.value_hessian(solution) @ along,
        ):  # fmt: skip
            np.testing.assert_allclose(product, slopes[0], atol=1e-5 * scale)
        compared += solution.violation > 1e-3
    assert compared >= 4


def test_inside_the_box_a_soft_one_is_a_hard_one(controllers, draw):
    nmpc, inside = paper.nmpc(box="soft"), 0
    for state, theta in draw(30, seed=65):
        hard = controllers["riccati"].solve(state, theta)
        solution = nmpc.solve(state, theta, hard)
        if solution.violation > 0:
            continue
        inside += 1
        assert solution.value == pytest.approx(hard.value, rel=1e-7)
        scale = np.abs(hard.features).max()
        np.testing.assert_allclose(solution.features, hard.features, atol=1e-5 * scale)
    assert inside >= 25


def test_only_a_soft_box_is_left_for_a_target_behind_it():
    """The target lies 2.5 m behind the wall, and the walls' price is a tenth of the obstacles'."""
    state = np.array([5.9, 2.0, 0.0])
    hard, priced = (soft(10.0, 6.0, soft_box=one).solve(state, THETA) for one in (False, True))
    assert hard.violation <= 1e-6
    assert priced.violation > 0.1
    assert priced.value < hard.value


@pytest.mark.parametrize("omega", [0.1, 3.0, 100.0])
def test_how_far_one_stage_goes_is_the_minimum_of_a_parabola_with_a_kink(
    point_mass, open_field, omega
):
    """With one stage each axis is a parabola in u; from the wall on its slope is omega more."""
    theta = np.array([1.0, 1.0, 0.1, 0.1, 0.01, 0.01, 9.0, 9.0, 0.1, 0.1, 0.0])
    task, state = open_field(box=2.5, soft_box=True), np.array([-2.4, -2.0, 2.3, 0.0])
    nmpc = Nmpc(point_mass(), task, horizon=1, gamma=GAMMA, slack_weight=omega)
    error, weights = state - task.target, theta**2

    def axis(place: int, speed: int, price: float) -> tuple[float, float]:
        """The best input of one axis, and how far its speed then exceeds the wall."""
        reach = np.array([H**2 / 2, H])
        e = np.array([error[place] + H * state[speed], error[speed]])
        Q = weights[6:][[place, speed]]
        curve = weights[4 + place] + GAMMA * Q @ reach**2
        slope = GAMMA * Q @ (e * reach)
        wall = (2.5 - state[speed]) / H
        free, charged = -slope / curve, -(slope + GAMMA * price * H / 2) / curve
        u = free if free <= wall else max(charged, wall)
        return u, max(0.0, state[speed] + H * u - 2.5)

    (u, left), (v, stayed) = axis(0, 2, omega), axis(1, 3, omega)
    assert stayed == 0
    later = state + H * np.array([*state[2:], 0, 0])
    later += np.array([H**2 / 2 * u, H**2 / 2 * v, H * u, H * v])
    value = weights[:4] @ error**2 + weights[4:6] @ np.array([u, v]) ** 2
    value += GAMMA * (weights[6:10] @ (later - task.target) ** 2 + omega * left)
    solution = nmpc.solve(state, theta)
    np.testing.assert_allclose(solution.action, [u, v], atol=1e-5)
    assert solution.violation == pytest.approx(left, abs=1e-6)
    assert solution.value == pytest.approx(value, rel=1e-6)
    assert (left > 0) == (omega < 20)


@pytest.mark.parametrize("solver", ["fatrop", "ipopt", Ipopt(tolerance=1e-5)], ids=str)
def test_other_solvers_refuse_a_soft_box(solver):
    with pytest.raises(ValueError, match="can only forbid to leave the box: soft_box = True") as e:
        soft(solver=solver)
    assert "\n" not in str(e.value)


def test_where_riccati_cannot_be_compiled_a_soft_box_is_refused(monkeypatch):
    monkeypatch.setattr(jit, "numba_version", lambda: None)
    nmpc = soft()
    message = "numba is not installed, and fatrop can only forbid to leave the box: soft_box = True"
    with pytest.raises(ValueError, match=f"^{message}$"):
        nmpc.solve(START, THETA)
