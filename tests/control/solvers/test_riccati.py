"""riccati: the box as a penalty, second tries, how it gives up, and what replaces it."""

import sys

import casadi as ca
import numpy as np
import pytest
from scipy.special import erfinv

from nmpcrl.control import Fatrop, Nmpc, Plant, Riccati, SolverError, Task
from nmpcrl.control.codegen import jit
from nmpcrl.control.solvers.nlpsol import Program
from nmpcrl.control.solvers.riccati import machine_code
from nmpcrl.report.trace import interpreted
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
START = np.array(paper.START)
WARNING = "fatrop solves instead of riccati"


@pytest.fixture
def riccati(controllers) -> Nmpc:
    """The paper's controller with the solver of this package."""
    return controllers["riccati"]


@pytest.mark.parametrize(
    "state", [(-3.05, 2.0, 0.0), (9.0, 9.4, 1.0), (50.0, 1.0, 0.0), (1e3, -1e3, 9)]
)
def test_from_outside_there_is_a_plan_that_says_how_far_it_leaves_the_box(riccati, state):
    solution = riccati.solve(np.array(state), THETA)
    later, task = solution.states[1:], riccati.task
    beyond = np.maximum(later - task.upper, task.lower - later).max()
    assert solution.violation == pytest.approx(max(0, beyond), abs=1e-9)
    reach = 0.6 * riccati.plant.period  # of one step
    outside = np.maximum(solution.states - task.upper, task.lower - solution.states).max()
    assert solution.violation >= outside - reach - 1e-9
    assert (np.abs(solution.inputs) <= riccati.plant.upper).all()


def test_from_far_outside_the_plan_heads_for_the_box_as_fast_as_it_can(riccati):
    solution = riccati.solve(np.array([50.0, 1.0, np.pi]), THETA)
    np.testing.assert_allclose(np.diff(solution.states[:, 0]), -0.12, atol=1e-4)


def test_inside_nothing_is_violated_whatever_a_slack_costs(riccati):
    """The box outweighs the obstacles even where these are dear."""
    task = paper.task()
    for omega in (1.0, 100.0, 1e4):
        nmpc = Nmpc(riccati.plant, task, slack_weight=omega)
        for obstacle in task.obstacles:
            state = np.array([obstacle.x, -2.99, -np.pi / 2])
            assert nmpc.solve(state, THETA).violation <= 1e-6


def limited(**limits: int) -> Nmpc:
    """The paper's controller run by Python, with other limits of iterations and one cold start."""
    plain = interpreted(paper.nmpc().problem)
    vars(plain).update(limits)
    return paper.nmpc(solver=Riccati(code=lambda _: plain.find, starts=1))


def test_a_warm_start_that_is_no_use_is_followed_by_a_cold_start(riccati):
    other = THETA * np.linspace(0.5, 2, 9)
    warm_start, cold = riccati.solve(START, THETA), riccati.solve(START + 0.1, other)
    assert (cold.restarts, cold.status) == (0, "solved")
    nmpc = limited(WARM_LIMIT=1)
    shifted = nmpc.solve(START + 0.1, other, warm_start)
    assert (shifted.restarts, shifted.status) == (1, "restarted")
    same = nmpc.solve(START, other, warm_start)
    assert (same.restarts, same.status) == (2, "restarted")
    assert shifted.value == pytest.approx(cold.value)


def test_a_warm_start_of_nans_does_no_harm(riccati):
    warm_start, exact = riccati.solve(START, THETA), riccati.solve(START, THETA)
    warm_start.point[:] = np.nan
    for state in (START, START + 1e-3):
        solution = riccati.solve(state, THETA, warm_start)
        assert np.isfinite(solution.point).all()
        assert solution.value == pytest.approx(exact.value, rel=1e-2)


def test_when_it_gives_up_it_says_what_it_tried(monkeypatch):
    def no_plan(_program, state, theta, *_, **__):
        raise SolverError("fatrop found none", state, theta)

    monkeypatch.setattr(Program, "solve", no_plan)
    with pytest.raises(SolverError) as caught:
        limited(COLD_LIMIT=1).solve(START, THETA)
    assert caught.value.status.startswith(
        "riccati found no optimum from 6 starts (the last ran out of iterations after 1 iteration"
    )
    assert "with a relative error of" in caught.value.status
    assert "in state [-2.5  1.5  0. ] with theta [1." in str(caught.value)
    assert "\n" not in str(caught.value)


def strange(solver: Riccati | Fatrop) -> Nmpc:
    """A controller that cannot be compiled: its dynamics hold an operation that `codegen` lacks."""
    plant = Plant(lambda s, a: ca.erfinv(a), ("x", "y"), ("u", "v"), [-0.9] * 2, [0.9] * 2)
    return Nmpc(plant, Task([0, 0], [1, 1], [-9] * 2, [9] * 2, weights=[1, 1]), solver=solver)


@pytest.mark.parametrize("reason", ["numba is not installed", "OP_ERFINV"])
def test_where_nothing_can_be_compiled_fatrop_solves_and_says_so_once(monkeypatch, recwarn, reason):
    """What was asked for stays; plant and task compute as before."""
    asked, action = Riccati(tolerance=1e-7), np.array([0.3, 0.1])
    if reason == "OP_ERFINV":
        state, theta, make = np.array([1.0, 2.0]), np.array([1, 1, 0.1, 0.1, 1, 1, 0.0]), strange
        stepped, cost = state + 0.2 * erfinv(action), 1 + np.hypot(*action)  # near the target
    else:
        state, theta, make = START, THETA, lambda solver: paper.nmpc(solver=solver)
        compiled = make(asked)
        assert compiled.solve(state, theta).solver == "riccati"
        stepped = compiled.plant.step(state, action)
        cost = compiled.task.stage_cost(state, action)
        monkeypatch.setattr(jit, "numba_version", lambda: None)
    nmpc, exact = make(asked), make(Fatrop(tolerance=1e-7))
    for given in (None, action):
        solution = nmpc.solve(state, theta, action=given)
        np.testing.assert_array_equal(solution.point, exact.solve(state, theta, action=given).point)
        assert solution.solver == "fatrop"
        assert nmpc.kkt_residual(solution) < 1e-4
    product = nmpc.value_hessian(solution) @ theta
    np.testing.assert_array_equal(nmpc.value_hessian_times(solution, theta), product)
    assert nmpc.solver is asked
    np.testing.assert_allclose(nmpc.plant.step(state, action), stepped)
    assert nmpc.task.stage_cost(state, action) == pytest.approx(cost)
    (said,) = (str(one.message) for one in recwarn if WARNING in str(one.message))
    assert reason in said


def test_only_what_is_called_from_python_is_compiled_for_it(riccati):
    package = machine_code(riccati.problem).__module__.rpartition(".")[0]
    jitted = {
        found.__name__: found.targetoptions.get("no_cpython_wrapper", False)
        for name, module in list(sys.modules.items())
        if name.startswith(f"{package}.")
        for found in vars(module).values()
        if hasattr(found, "targetoptions")
    }
    assert {"factorise", "expand_stage"} < set(jitted)
    assert {name for name, inner in jitted.items() if not inner} == {"find"}
