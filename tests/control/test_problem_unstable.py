"""`Problem` where a cold guess misleads: unstable models, maxima, and costs that are steep."""

from contextlib import suppress
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Nmpc, Problem, Riccati, SolverError, Status, rk4
from nmpcrl.control.solvers.codes import End
from nmpcrl.study.problems import gros_zanon

PERIOD = 0.1  # s


def swing(x, u, gravity):
    """A pendulum that stands where its angle is 0."""
    return ca.vertcat(x[1], gravity * ca.sin(x[0]) + u[0])


def pendulum(horizon: int, bound: float = 5.0) -> Problem:
    return Problem(
        states=2, inputs=1, horizon=horizon, theta={"gravity": 9.81, "price": 0.01},
        model=lambda x, u, th: rk4(lambda x, u: swing(x, u, th["gravity"]), x, u, PERIOD),
        stage=lambda x, u, th: x[0] ** 2 + 0.1 * x[1] ** 2 + th["price"] * u[0] ** 2,
        terminal=lambda x, th: 50 * x[0] ** 2 + 5 * x[1] ** 2, lower=-bound, upper=bound,
    )  # fmt: skip


def scalar(horizon: int, stage=None, bound=np.inf, size=1.0) -> Problem:
    return Problem(
        states=1, inputs=1, horizon=horizon, theta={"a": 1.5, "size": size}, lower=-bound,
        upper=bound, model=lambda x, u, th: th["a"] * x + u,
        stage=stage or (lambda x, u, th: x**2 + u**2),
    )  # fmt: skip


def cart_pole(horizon: int) -> Problem:
    """A pole of 0.1 kg and 0.5 m on a cart of 1 kg: position, angle from upright, and speeds."""

    def motion(x, u):
        s, c = ca.sin(x[1]), ca.cos(x[1])
        mass, spin = 1.1 - 0.1 * c**2, 0.05 * x[3] ** 2 * s
        cart = (u[0] + spin - 0.981 * s * c) / mass
        pole = (-u[0] * c - spin * c + 1.1 * 9.81 * s) / (0.5 * mass)
        return ca.vertcat(x[2], x[3], cart, pole)

    def cost(x, *weights):
        bend = 2 * (1 - ca.cos(x[1]))
        return ca.dot(ca.DM(weights), ca.vertcat(x[0] ** 2, bend, x[2] ** 2, x[3] ** 2))

    return Problem(
        states=4, inputs=1, horizon=horizon, theta={"price": 0.001}, lower=-20.0, upper=20.0,
        model=lambda x, u, th: rk4(motion, x, u, 0.05),
        stage=lambda x, u, th: cost(x, 1, 5, 0.01, 0.01) + th["price"] * u[0] ** 2,
        terminal=lambda x, th: cost(x, 10, 100, 1, 5),
    )  # fmt: skip


ANGLES = [(a, w) for a in (-0.4, -0.2, 0.05, 0.3) for w in (-0.3, 0.0, 0.3)]
NEAR = [(p, a, 0.0, w) for p in (-0.5, 0.5) for a in (-0.3, 0.1) for w in (0.0, 0.5)]
HANGING = [(p, np.pi + a, 0.0, w) for p in (-0.5, 0.0) for a in (-0.3, 0.01) for w in (0.0, 0.5)]
HELD = {
    **{f"pendulum {N}": (pendulum(N), ANGLES) for N in (1, 10, 30, 60, 100)},
    **{f"cart-pole {N}": (cart_pole(N), NEAR + HANGING) for N in (25, 60, 100)},
}


@pytest.mark.weekly
@pytest.mark.slow
@pytest.mark.parametrize("name", HELD)
def test_cold_solves_are_no_worse_than_those_of_fatrop_and_ipopt(name):
    """From the same start, all at s; where minima are many, more starts are compared."""
    problem, states = HELD[name]
    ours = Nmpc(problem)
    others = [Nmpc(problem, solver=solver) for solver in ("fatrop", "ipopt")]
    taken_over = 0
    for state in states:
        values = []
        for other in others:
            with suppress(SolverError):
                values.append(other.solve(state, problem.theta).value)
        if values:
            found = ours.solve(state, problem.theta)
            taken_over += found.status == Status.TAKEN_OVER
            assert found.value <= 1.01 * min(values) + 1e-9, state
    assert taken_over == 0


@pytest.mark.parametrize("horizon", [20, 60, 100])
@pytest.mark.parametrize("state", [(0.1, 0.0), (-0.4, 0.5)])
def test_a_pendulum_that_stands_is_planned_to_stand(horizon, state):
    """With fatrop's value, and the derivatives of dense algebra."""
    problem, along = pendulum(horizon), np.array([1.0, 0.01])
    ours, dense = (Nmpc(problem, solver=name) for name in ("riccati", "fatrop"))
    found, other = (nmpc.solve(state, problem.theta) for nmpc in (ours, dense))
    assert found.value == pytest.approx(other.value, rel=1e-6)
    np.testing.assert_allclose(found.features, other.features, rtol=1e-5)
    product = dense.value_hessian(other) @ along
    np.testing.assert_allclose(ours.value_hessian_times(found, along), product, rtol=1e-4)
    np.testing.assert_allclose(ours.policy_jacobian(found), dense.policy_jacobian(other), rtol=1e-4)


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize("size", [1.0, 1e4, 1e8])
def test_a_cost_that_is_flat_at_rest_and_steep_elsewhere_is_scaled(size):
    problem = scalar(12, lambda x, u, th: th["size"] * (x**4 + u**4), bound=1.0, size=size)
    nmpc, unit = Nmpc(problem), scalar(12, lambda x, u, th: x**4 + u**4, bound=1.0)
    for state in (-1.5, 0.3, 1.9):
        value = Nmpc(unit).solve([state], unit.theta).value
        assert nmpc.solve([state], problem.theta).value == pytest.approx(size * value, rel=1e-6)


@pytest.mark.usefixtures("interpreted")
def test_ipopt_takes_over_where_riccati_finds_no_optimum(monkeypatch):
    problem = scalar(5)
    nmpc = Nmpc(problem)
    code, best = nmpc._free.solver, nmpc.solve([1.0], problem.theta)
    monkeypatch.setattr(code, "code", lambda *_: (0.0, 1.0, float(End.STALLED), 0.0, 1.0, 7.0))
    found = nmpc.solve([1.0], problem.theta, best)
    assert (found.status, found.solver) == (Status.TAKEN_OVER, "ipopt")
    assert found.value == pytest.approx(best.value, rel=1e-6)
    policy = nmpc.policy_jacobian(best)
    monkeypatch.setattr(code, "slopes", None)
    np.testing.assert_allclose(nmpc.policy_jacobian(found), policy, atol=1e-5)


@pytest.mark.usefixtures("interpreted")
def test_what_no_solver_solves_is_an_error_of_the_one_that_was_asked():
    problem = scalar(3, lambda x, u, th: -(u**2) - x**2)
    with pytest.raises(SolverError, match="riccati"):
        Nmpc(problem, solver=replace(Riccati(), starts=1)).solve([1.0], problem.theta)


def test_a_model_in_which_every_plan_explodes_is_refused_and_soon():
    """Where a learner's theta has diverged; from this state fatrop never returned."""
    state = [0.07241521776375774, 0.17795563128918557]
    theta = [
        -0.02346025254120378, -0.6035290003204876, -1.028794766158787e-09, 9.976703483394326,
        8.976703483650276, 52.69894282553909, -471.47698769420595, -4.878826558153828,
        -2.123557218177235, 0.17250770288086642, -368.3687223387759, -35.30873858947078,
        -4826.768963179773, -2449.217164234251, -81.67612537518058, 438.4537688090195,
    ]  # fmt: skip
    with pytest.raises(SolverError, match=r"model makes .* times as much"):
        Nmpc(gros_zanon.problem()).solve(state, theta)
