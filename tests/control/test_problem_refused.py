"""What no `Problem` can be is refused where it is written, in one sentence with its name."""

import math

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Ipopt, Nmpc, Parameter, Plant, Problem, Riccati, Soft, SolverError, Task
from nmpcrl.study import paper

STRANGER = ca.SX.sym("stranger")


def problem(**changes) -> Problem:
    fields = {
        "states": 2,
        "inputs": 1,
        "horizon": 3,
        "theta": {"alpha": 1.0, "A": np.eye(2)},
        "model": lambda x, u, th: th["A"] @ x + u,
        "stage": lambda x, u, th: ca.sumsqr(x) + th["alpha"] * ca.sumsqr(u),
    }
    return Problem(**fields | changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"model": lambda x, u, th: ca.vertcat(math.sin(x[0]), u)}, "model holds nan.*ca.sin"),
        ({"model": lambda x, u, th: [x[0], x[1], u]}, "model returns 3 numbers.* 2 states"),
        ({"model": lambda x, u, th: x if x[0] > 0 else -x}, "model .* Python `if`.*ca.if_else"),
        ({"model": lambda x, u, th: max(x[0], 0) * x}, "model .* ca.fmax"),
        ({"model": lambda x, u: x}, r"model is called as model\(x, u, th\)"),
        ({"model": lambda x, u, th: ca.MX.sym("y", 2)}, "model must return a column of SX"),
        ({"model": lambda x, u, th: "x"}, "model must return a column of SX"),
        ({"model": lambda x, u, th: STRANGER * x}, "model uses stranger, which is none of"),
        ({"model": 3}, "model = 3 must be a function"),
        ({"stage": lambda x, u, th: x}, "stage returns 2 numbers; it must return 1 cost"),
        ({"stage": lambda x, u, th: x @ x}, "stage cannot be written down.*dimensions"),
        ({"stage": lambda x, u, th: th["alhpa"]}, "theta has no 'alhpa'; did you mean 'alpha'"),
        ({"terminal": lambda x, u, th: 0}, r"terminal is called as terminal\(x, th\)"),
        ({"theta": {}}, "theta is empty"),
        ({"theta": {"alpha": "one"}}, "theta alpha = 'one' must be a number or an array"),
        ({"theta": {"alpha": math.nan}}, "theta alpha = nan must hold finite numbers"),
        ({"theta": {"alpha": Parameter(1, 2, 3)}}, "theta 'alpha' starts at .1.., outside"),
        ({"lower": 1, "upper": 0}, r"lower = \[1.\] must lie below upper = \[0.\]"),
        ({"lower": [1, 2]}, r"lower = \[1, 2\] must hold 1 numbers"),
        ({"horizon": 0}, "horizon = 0 must be a whole number"),
        ({"states": 1.5}, "states = 1.5 must be a whole number"),
        ({"gamma": 1.2}, r"gamma = 1.2 must lie in \(0, 1\]"),
        ({"soft": [Soft(lambda x, u, th: th["alpha"])]}, r"soft\[0\] has a row that depends on"),
        ({"soft": [Soft(lambda x, u, th: u, stages=[3])]}, r"soft\[0\] depends on u, and there"),
        ({"soft": [Soft(lambda x, u, th: x, stages=7)]}, r"soft\[0\].stages = 7 must lie among"),
        ({"soft": [Soft(lambda x, u, th: x, weight=[1, 2, 3])]}, r"soft\[0\] has 2 rows and 3"),
        ({"soft": [Soft(lambda x, u, th: x, weight=0)]}, r"soft\[0\].weight = 0 must be positive"),
    ],
)
def test_a_problem_that_is_none(changes, message):
    with pytest.raises(ValueError, match=message) as caught:
        problem(**changes)
    assert "\n" not in str(caught.value)


def test_a_solve_that_is_none():
    nmpc, theta = Nmpc(problem(), solver="ipopt"), problem().theta
    with pytest.raises(ValueError, match=r"theta has shape \(3,\); it must be \(5,\)"):
        nmpc.solve(np.zeros(2), theta[:3])
    with pytest.raises(ValueError, match=r"state .* must hold finite numbers"):
        nmpc.solve(np.array([np.inf, 0]), theta)
    with pytest.raises(ValueError, match=r"data has no 'wind' .it has none"):
        nmpc.solve(np.zeros(2), theta, data={"wind": 1.0})
    with pytest.raises(ValueError, match=r"stage = 4 must lie among 0, \.\.\., 3"):
        nmpc.plan_jacobian(nmpc.solve(np.zeros(2), theta), 4)
    assert nmpc.solve(np.array([3000.0, -2e5]), theta).value > 0  # no unit is forbidden


def test_a_controller_that_is_none():
    with pytest.raises(ValueError, match="a Problem has its own costs, horizon, gamma"):
        Nmpc(problem(), horizon=4)
    with pytest.raises(ValueError, match=r"a plant needs a task: write Nmpc\(plant, task\)"):
        Nmpc(paper.nmpc().plant)
    with pytest.raises(ValueError, match="data belong to a Problem"):
        paper.nmpc().solve(np.array(paper.START), np.array(paper.THETA_INIT), data={"wind": 1})
    with pytest.raises(ValueError, match="only the parameters of a `Problem` have names"):
        _ = paper.nmpc().solve(np.array(paper.START), np.array(paper.THETA_INIT)).features_by_name


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize("solver", [Riccati(), Ipopt()])
def test_a_plan_that_leaves_all_numbers_is_no_solution(solver):
    """A model that blows up from anywhere, however low its cost is said to be."""
    wild = problem(
        model=lambda x, u, th: 1e5 * x + u, stage=lambda x, u, th: th["alpha"] * ca.sumsqr(u)
    )
    with pytest.raises(SolverError, match="is the period too long for the dynamics"):
        Nmpc(wild, solver=solver).solve(np.ones(2), wild.theta)


def plant(dynamics, states=2, **options) -> Plant:
    names = tuple("abc"[:states])
    return Plant(dynamics, names, ("u",), lower=[-1], upper=[1], **options)


@pytest.mark.parametrize(
    ("dynamics", "message"),
    [
        (lambda s, a: ca.vertcat(math.sin(s[0]), a), "dynamics holds nan.*ca.sin"),
        (lambda s, a: [s[0]], "dynamics returns 1 numbers; it must return 2 states"),
        (lambda s, a: s if s[0] > 0 else -s, "dynamics .* Python `if`"),
        (lambda s: s, r"dynamics is called as dynamics\(state, action\)"),
    ],
)
def test_a_plant_that_is_none(dynamics, message):
    with pytest.raises(ValueError, match=message):
        plant(dynamics)


def test_dynamics_may_be_a_list():
    one, other = plant(lambda s, a: [s[1], a]), plant(lambda s, a: ca.vertcat(s[1], a))
    np.testing.assert_array_equal(one.step([1, 2], [0.5]), other.step([1, 2], [0.5]))


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize("solver", ["riccati", "fatrop"])
def test_a_plant_may_have_one_state_and_a_task_no_obstacle(solver):
    tank = plant(lambda s, a: a - 0.1 * s, states=1)
    np.testing.assert_allclose(tank.step(np.array([1.0]), np.array([0.0])), [np.exp(-0.02)])
    task = Task([0.0], [0.5], [-1.0], [1.0], weights=[1.0])
    nmpc = Nmpc(tank, task, horizon=5, solver=solver)
    solution = nmpc.solve(np.array([0.0]), np.array([1.0, 0.1, 1.0, 0.0]))
    assert solution.states.shape == (6, 1)
    assert 0.3 < solution.states[-1, 0] <= 0.6
    assert nmpc.kkt_residual(solution) < 1e-5
    assert task.stage_cost(np.array([0.0]), np.array([0.0])) == pytest.approx(0.25)


def test_dynamics_faster_than_the_period_take_substeps():
    """Eq. (18) at 30 time constants a step is no motor; twenty substeps are."""
    motor = plant(lambda s, a: (a - s) / 1e-3, states=1, period=0.03)
    assert abs(motor.step(np.array([1.0]), np.array([0.0]))[0]) > 1e3
    fine = plant(lambda s, a: (a - s) / 1e-3, states=1, period=0.03, substeps=40)
    assert abs(fine.step(np.array([1.0]), np.array([0.0]))[0]) < 1e-9
    with pytest.raises(ValueError, match=r"plant.substeps = 0 must be a whole number"):
        plant(lambda s, a: s, substeps=0)
