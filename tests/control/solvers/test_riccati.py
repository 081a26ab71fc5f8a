"""riccati: the box as a penalty, second tries, how it gives up, and what replaces it."""

import casadi as ca
import numpy as np
import pytest
from scipy.special import erfinv

from nmpcrl.control import Fatrop, Nmpc, Plant, Riccati, SolverError, Task
from nmpcrl.control.solvers.nlpsol import Program
from nmpcrl.control.solvers.riccati import Compiled
from nmpcrl.control.solvers.starts import LAST
from nmpcrl.report.trace import interpreted
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
START = np.array(paper.START)
WARNING = "fatrop solves instead of riccati"


@pytest.mark.parametrize(
    "state", [(-3.05, 2.0, 0.0), (9.0, 9.4, 1.0), (50.0, 1.0, 0.0), (1e3, -1e3, 9)]
)
def test_from_outside_there_is_a_plan_that_says_how_far_it_leaves_the_box(controllers, state):
    riccati = controllers["riccati"]
    solution = riccati.solve(np.array(state), THETA)
    later, task = solution.states[1:], riccati.task
    beyond = np.maximum(later - task.upper, task.lower - later).max()
    assert solution.violation == pytest.approx(max(0, beyond), abs=1e-9)
    reach = 0.6 * riccati.plant.period  # of one step
    outside = np.maximum(solution.states - task.upper, task.lower - solution.states).max()
    assert solution.violation >= outside - reach - 1e-9
    assert (np.abs(solution.inputs) <= riccati.plant.upper).all()


def limited(**limits: int) -> Nmpc:
    """The paper's controller run by Python, with other limits of iterations and one cold start."""
    plain = interpreted(paper.nmpc().problem)
    vars(plain).update(limits)
    return paper.nmpc(solver=Riccati(code=lambda _: plain.find, starts=1))


def test_a_warm_start_that_is_no_use_is_followed_by_a_cold_start(controllers):
    riccati = controllers["riccati"]
    other = THETA * np.linspace(0.5, 2, 9)
    warm_start, cold = riccati.solve(START, THETA), riccati.solve(START + 0.1, other)
    assert (cold.restarts, cold.status) == (0, "solved")
    nmpc = limited(WARM_LIMIT=1)
    shifted = nmpc.solve(START + 0.1, other, warm_start)
    assert (shifted.restarts, shifted.status) == (1, "restarted")
    same = nmpc.solve(START, other, warm_start)
    assert (same.restarts, same.status) == (2, "restarted")
    assert shifted.value == pytest.approx(cold.value)


def test_when_it_gives_up_it_says_what_it_tried(monkeypatch):
    def no_plan(_program, asked):
        raise SolverError("Ipopt found none", asked.state, asked.theta)

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


def test_where_nothing_can_be_compiled_fatrop_solves_and_says_so_once(recwarn):
    """What was asked for stays; plant and task compute as before."""
    asked, action = Riccati(tolerance=1e-7), np.array([0.3, 0.1])
    state, theta = np.array([1.0, 2.0]), np.array([1, 1, 0.1, 0.1, 1, 1, 0.0])
    stepped, cost = state + 0.2 * erfinv(action), 1 + np.hypot(*action)  # near the target
    nmpc, exact = strange(asked), strange(Fatrop(tolerance=1e-7))
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
    assert "OP_ERFINV" in said


@pytest.mark.parametrize("starts", [1, 6, 12, 64])
def test_no_start_is_tried_twice(starts):
    compiled = Compiled(paper.nmpc().ocp, None, Riccati(starts=starts))
    tried = {one.tobytes() for one in (*compiled.others, *compiled.drawn)}
    assert len(tried) == starts - 1 + LAST
