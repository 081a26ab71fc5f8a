"""What cannot be is refused where it is written, in one sentence with its name."""

import math
import re
import warnings
from contextlib import suppress

import casadi as ca
import numpy as np
import pytest
from small_problems import BEHIND, plant, task

from nmpcrl.control import (
    Hard,
    Ipopt,
    Nmpc,
    Obstacle,
    Parameter,
    Problem,
    Riccati,
    Soft,
    SolverError,
    differential_drive,
)

STRANGER = ca.SX.sym("stranger")
AS = r".* Soft\(lambda x, u, th: ca.vertcat\(h, -h\), weight=w\)"
WITH_DATA = {"model": lambda x, u, th, d: x + u, "stage": lambda x, u, th, d: u**2}


def problem(**changes) -> Problem:
    fields = {
        "states": 2, "inputs": 1, "horizon": 3, "theta": {"alpha": 1.0, "A": np.eye(2)},
        "model": lambda x, u, th: th["A"] @ x + u,
        "stage": lambda x, u, th: ca.sumsqr(x) + th["alpha"] * ca.sumsqr(u),
    }  # fmt: skip
    return Problem(**fields | changes)


def disc(**changes) -> Obstacle:
    return Obstacle(**{"x": 0.0, "y": 0.0} | changes)


def robot(**changes) -> Nmpc:
    return Nmpc(**{"plant": differential_drive(), "task": task()} | changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"model": lambda x, u, th: [x[0], math.sin(x[1])]}, r"model\[1\] holds nan.*ca.sin"),
        ({"model": lambda x, u, th: x * np.inf}, r"model\[0\] holds inf: write a large number"),
        ({"model": lambda x, u, th: np.eye(3) @ x}, "model cannot be written down.*dimensions"),
        ({"model": lambda x, u, th: [x[0], x[1], u]}, "model returns 3 numbers.* 2 states"),
        ({"model": lambda x, u, th: x if x[0] > 0 else -x}, "model .* Python `if`.*ca.if_else"),
        ({"model": lambda x, u: x}, r"model is called as model\(x, u, th\)"),
        ({"model": lambda x, u, th: ca.MX.sym("y", 2)}, "model must return a column of SX"),
        ({"model": lambda x, u, th: STRANGER * x}, r"model\[0\] uses stranger, which is none of"),
        ({"model": 3}, "model = 3 must be a function"),
        ({"stage": lambda x, u, th: x}, "stage returns 2 numbers; it must return 1 cost"),
        ({"terminal": lambda x, u, th: 0}, r"terminal is called as terminal\(x, th\)"),
        ({"theta": {}}, "theta is empty"),
        ({"theta": [1.0]}, r"theta = \[1.0\] must have names: write {'name': numbers}"),
        ({"data": [1.0]}, r"data = \[1.0\] must have names"),
        ({"theta": {"alpha": "one"}}, "theta alpha = 'one' must be a number or an array"),
        ({"theta": {"alpha": math.nan}}, "theta alpha = nan must hold finite numbers"),
        ({"theta": {"alpha": Parameter(1, 2, 3)}}, "theta 'alpha' starts at 1.0, outside"),
        ({"lower": 1, "upper": 0}, r"lower = \[1.\] must lie below upper = \[0.\]"),
        ({"horizon": 0}, "horizon = 0 must be a whole number"),
        ({"gamma": 1.2}, r"gamma = 1.2 must lie in \(0, 1\]"),
        ({"soft": (lambda x, u, th: x, 3.0)}, r"soft\[0\] = <function .* write soft=\[Soft\(row"),
        ({"soft": [Soft(lambda x, u, th: x), 3.0]}, r"soft\[1\] = 3.0 must be a Soft"),
        ({"soft": [Soft(lambda x, u, th: th["alpha"])]}, r"soft\[0\] has a row that depends on"),
        ({"soft": [Soft(lambda x, u, th: u, stages=[3])]}, r"soft\[0\] depends on u, and there"),
        ({"soft": [Soft(lambda x, u, th: x, stages=7)]}, r"soft\[0\].stages = 7 must lie among"),
        ({"soft": [Soft(lambda x, u, th: x, weight=0)]}, r"soft.0..weight = 0.0 must hold 2 pos"),
        ({"hard": Soft(lambda x, u, th: x)}, r"hard\[0\] = Soft.* write hard=\[Hard\(row\)\]"),
        ({"state_lower": 1, "state_upper": 0}, r"state_lower = .* must lie below state_upper"),
        ({"soft": Soft(lambda x, u, th: x, each="discs")}, "each = .'discs'. must name one table"),
        ({"soft": Soft(lambda x, u, th, d: x, each="at"), "data": {"at": [1.0]}, **WITH_DATA},
         "data 'at' must be a table"),
    ],
)  # fmt: skip
def test_a_problem_that_is_none(changes, message):
    with pytest.raises(ValueError, match=message) as caught:
        problem(**changes)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "changes", "message"),
    [
        (plant, {"upper": np.ones(2)}, r"plant.upper = \[1. 1.\] must hold 1 numbers"),
        (plant, {"lower": [1]}, r"plant.lower = \[1.\] must lie below plant.upper = \[1.\]"),
        (plant, {"period": 0.0}, "plant.period = 0.0 must be a positive number"),
        (plant, {"state_names": ("x",)}, "dynamics returns 2 numbers; it must return 1 state"),
        (plant, {"substeps": 0}, "plant.substeps = 0 must be a whole number"),
        (plant, {"dynamics": lambda s, a: [math.sin(s[0]), a]}, r"dynamics\[0\] holds nan.*ca.sin"),
        (plant, {"dynamics": lambda s: s}, r"dynamics is called as dynamics\(state, action\)"),
        (task, BEHIND, r"target \[8.5\s+2.\s+1.57\] is outside the box \[-9, 3\]"),
        (task, {"start": [-4.0, 1.5, 0.0]}, r"start .* is outside the box \[-3, 9\]"),
        (task, {"start": [0.0, 1.5, np.inf]}, "task.start = .* must be finite"),
        (task, {"target": [8.5, 2.0]}, "task.target = .* must hold 3 numbers"),
        (task, {"weights": np.ones(2)}, "task.weights = .* must hold 3 numbers"),
        (task, {"lower": [9.0, -3, -np.inf]}, "task.lower = .* must lie below task.upper"),
        (task, {"near": -1.0}, "task.near = -1.0 must be 0 or more"),
        (disc, {"x": np.nan}, r"obstacle centre \(nan, 0.0\) must be finite"),
        (disc, {"diameter": 0.0}, "obstacle diameter 0.0 must be a positive length"),
        (robot, {"horizon": 0}, "horizon = 0 must be a whole number, 1 or more"),
        (robot, {"gamma": 0.0}, r"gamma = 0.0 must lie in \(0, 1\]"),
        (robot, {"slack_weight": 0.0}, "slack_weight = 0.0 must be a positive number"),
        (robot, {"solver": "Riccati"}, "solver = 'Riccati' must be one of riccati, fatrop, ipopt$"),
        (robot, {"task": None}, r"a plant needs a task: write Nmpc\(plant, task\)"),
        (robot, {"plant": plant()}, "the task has 3 states and the plant 2"),
        (robot, {"plant": problem()}, "a Problem has its own costs, horizon, gamma"),
    ],
)
def test_a_plant_a_task_or_a_controller_that_is_none(make, changes, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        make(**changes)


def test_a_solve_that_is_none():
    nmpc, theta = Nmpc(problem(), solver="ipopt"), problem().theta
    with pytest.raises(ValueError, match=r"vector has shape \(2,\); it must be \(5,\)"):
        nmpc.value_hessian_times(nmpc.solve(np.zeros(2), theta), np.zeros(2))
    with pytest.raises(ValueError, match=r"data has no 'wind' .it has none"):
        nmpc.solve(np.zeros(2), theta, data={"wind": 1.0})
    with pytest.raises(ValueError, match="warm_start = 0 must be a Solution, which solve returns"):
        nmpc.solve(np.zeros(2), theta, 0)
    assert nmpc.solve(np.array([3000.0, -2e5]), theta).value > 0  # no unit is forbidden


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize("solver", [Riccati(), Ipopt()])
def test_a_plan_that_leaves_all_numbers_is_no_solution(solver):
    """A model that blows up from anywhere, however low its cost is said to be."""
    wild = problem(
        model=lambda x, u, th: 1e5 * x + u, stage=lambda x, u, th: th["alpha"] * ca.sumsqr(u)
    )
    with pytest.raises(SolverError, match="dynamics too fast for their period take more substeps"):
        Nmpc(wild, solver=solver).solve(np.ones(2), wild.theta)


@pytest.mark.parametrize("solver", ["fatrop", "ipopt"])
@pytest.mark.parametrize(
    ("changes", "state", "message"),
    [
        ({"stage": lambda x, u, th: th["alpha"] * ca.log(x[1]) + u**2}, [1.0, 0.0],
         r"; stage is -inf at x = \[1. 0.\], u = \[0.\]: keep it finite, as ca.log\(ca.fmax"),
        ({"stage": lambda x, u, th: u**2, "model": lambda x, u, th: [x[0], ca.sqrt(-x[1])]},
         [1.0, 2.0], r"; model\[1\] is nan at x = \[1. 2.\], u = \[0.\]"),
        ({"stage": lambda x, u, th: -ca.norm_2(x - 1) + u**2}, [1.0, 1.0],
         r"; the derivative of stage is nan at .*: write ca.sqrt\(ca.sumsqr\(x\) \+ 1e-9\)"),
        ({"hard": Hard(lambda x, u, th: ca.log(x) - u)}, [1.0, 0.0], r"; rows\[1\] is -inf at"),
    ],
)  # fmt: skip
def test_what_is_not_finite_where_a_plan_begins_is_named(solver, changes, state, message):
    nmpc = Nmpc(problem(**changes), solver=solver)
    with pytest.raises(SolverError, match=message) as caught:
        nmpc.solve(np.array(state), nmpc.problem.theta)
    assert "\n" not in str(caught.value)


def grows(growth: float, horizon: int) -> dict:
    return {"model": lambda x, u, th: growth * x + u, "horizon": horizon}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"stage": lambda x, u, th: ca.sumsqr(x) + ca.fabs(u)},
            rf"stage has a kink \(fabs\){AS}",
        ),
        ({"terminal": lambda x, th: ca.fmax(x[0], th["alpha"])}, r"terminal has a kink \(fmax\); "),
        ({"model": lambda x, u, th: ca.sign(x) * ca.fmin(u, 1)}, r"model has a kink \(fmin, sign"),
        ({"soft": Soft(lambda x, u, th: ca.if_else(u > 1, u, 1))}, r"rows has a kink \(if_else\);"),
        ({"stage": lambda x, u, th: ca.sumsqr(u) * ca.fmax(th["alpha"], 1)}, "$"),  # theta's alone
        (grows(1.5, 20), "$"),
        (grows(1.5, 60), r"model leads to 1e\+09 in 52 steps at rest: an unstable model"),
        (grows(12.0, 5), r"model makes 1e\+01 times as much .* model takes a shorter horizon"),
    ],
)
def test_why_a_solve_failed_is_told_with_what_to_write(changes, said):
    one = problem(**changes)
    why = Nmpc(one, solver="ipopt")._free.diagnosis.why(np.ones(2), one.theta, one.data)
    assert re.match(said, why)


WEIGHED = {
    "theta": {"q": 1.0, "r": 0.1, "root": 0.5, "slope": 0.3, "off": np.eye(2) + 0.1, "a": 0.9},
    "model": lambda x, u, th: th["a"] * x + u,
    "stage": lambda x, u, th: th["q"] * ca.sumsqr(x) + th["r"] * u**2 + th["slope"] * x[0],
    "terminal": lambda x, th: ca.sumsqr(th["root"] * x) + x.T @ th["off"] @ x,
    "lower": -1.0, "upper": 1.0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("values", "names"),
    [
        ([{"r": -1e-3}, {"r": -1.0}], ["r"]),  # once
        ([{"q": -1e-3, "r": -1e-3}], ["q, r"]),
        ([{"off": [[0.05, 0], [0, 1]]}, {"off": [[-0.05, 0], [0, 1]]}], []),  # 0.5^2 outweighs it
        ([{"off": [[-0.05, 0], [0, 1]]}, {"off": [[-3, 0], [0, 1]]}], ["off"]),
        ([{"off": [[1, -0.4], [-0.4, 1]]}], []),  # as positive as it was
        ([{"root": -0.5}, {"slope": -2.0}, {"a": -0.9}], []),  # whose sign bends nothing
    ],
)
def test_weights_that_turn_negative_are_named_once(values, names):
    nmpc = Nmpc(problem(**WEIGHED), solver="ipopt")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for some in values:
            with suppress(SolverError):
                nmpc.solve(np.array([0.4, 0.2]), nmpc.problem.vector(**some))
    assert len(caught) == len(names)
    for one, name in zip(caught, names, strict=True):
        assert f"theta {name} turned negative" in str(one.message)
        assert "write Parameter(start, lower=0)" in str(one.message)
        assert one.filename == __file__
