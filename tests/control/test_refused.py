"""What no `Problem` can be is refused where it is written, in one sentence with its name."""

import math
import re
import warnings
from contextlib import suppress

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import (
    Hard,
    Ipopt,
    Nmpc,
    Parameter,
    Problem,
    Riccati,
    Soft,
    SolverError,
    rk4,
)

STRANGER = ca.SX.sym("stranger")
WITH_DATA = {"model": lambda x, u, th, d: x + u, "stage": lambda x, u, th, d: u**2}


def problem(**changes) -> Problem:
    fields = {
        "states": 2, "inputs": 1, "horizon": 3, "theta": {"alpha": 1.0, "A": np.eye(2)},
        "model": lambda x, u, th: th["A"] @ x + u,
        "stage": lambda x, u, th: ca.sumsqr(x) + th["alpha"] * ca.sumsqr(u),
    }  # fmt: skip
    return Problem(**fields | changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"model": lambda x, u, th: ca.vertcat(math.sin(x[0]), u)},
            r"model\[0\] holds nan.*ca.sin",
        ),
        ({"model": lambda x, u, th: [x[0], math.exp(x[1])]}, r"model\[1\] holds nan.*ca.sin"),
        ({"model": lambda x, u, th: [x[0], float(u)]}, r"model\[1\] holds nan.*ca.sin"),
        ({"model": lambda x, u, th: x * math.log(x[0])}, r"model\[0\] holds nan: math's .*ca.sin"),
        ({"model": lambda x, u, th: x * np.inf}, r"model\[0\] holds inf: write a large number"),
        ({"model": lambda x, u, th: np.eye(3) @ x}, "model cannot be written down.*dimensions"),
        ({"model": lambda x, u, th: x[2] * x}, "model cannot be written down"),
        ({"model": lambda x, u, th: x if u else 2 * x}, "model .* Python `if`.*ca.if_else"),
        ({"model": lambda x, u, th: [x[0], x[1], u]}, "model returns 3 numbers.* 2 states"),
        ({"model": lambda x, u, th: x if x[0] > 0 else -x}, "model .* Python `if`.*ca.if_else"),
        ({"model": lambda x, u, th: max(x[0], 0) * x}, "model .* ca.fmax"),
        ({"model": lambda x, u: x}, r"model is called as model\(x, u, th\)"),
        ({"model": lambda x, u, th: ca.MX.sym("y", 2)}, "model must return a column of SX"),
        ({"model": lambda x, u, th: "x"}, "model must return a column of SX"),
        ({"model": lambda x, u, th: STRANGER * x}, r"model\[0\] uses stranger, which is none of"),
        ({"model": 3}, "model = 3 must be a function"),
        ({"stage": lambda x, u, th: x}, "stage returns 2 numbers; it must return 1 cost"),
        ({"stage": lambda x, u, th: x @ x}, "stage cannot be written down.*dimensions"),
        ({"stage": lambda x, u, th: th["alhpa"]}, "theta has no 'alhpa'; did you mean 'alpha'"),
        ({"terminal": lambda x, u, th: 0}, r"terminal is called as terminal\(x, th\)"),
        ({"theta": {}}, "theta is empty"),
        ({"theta": {"alpha": "one"}}, "theta alpha = 'one' must be a number or an array"),
        ({"theta": {"alpha": math.nan}}, "theta alpha = nan must hold finite numbers"),
        ({"theta": {"alpha": Parameter(1, 2, 3)}}, "theta 'alpha' starts at 1.0, outside"),
        ({"lower": 1, "upper": 0}, r"lower = \[1.\] must lie below upper = \[0.\]"),
        ({"lower": [1, 2]}, r"lower = .1. 2.. must hold 1 numbers"),
        ({"horizon": 0}, "horizon = 0 must be a whole number"),
        ({"states": 1.5}, "states = 1.5 must be a whole number"),
        ({"gamma": 1.2}, r"gamma = 1.2 must lie in \(0, 1\]"),
        (
            {"soft": (lambda x, u, th: x, 3.0)},
            r"soft\[0\] = <function .* write soft=\[Soft\(row, w",
        ),
        ({"soft": [Soft(lambda x, u, th: x), 3.0]}, r"soft\[1\] = 3.0 must be a Soft"),
        ({"soft": None}, r"soft\[0\] = None must be a Soft"),
        ({"soft": [Soft(lambda x, u, th: th["alpha"])]}, r"soft\[0\] has a row that depends on"),
        ({"soft": [Soft(lambda x, u, th: u, stages=[3])]}, r"soft\[0\] depends on u, and there"),
        ({"soft": [Soft(lambda x, u, th: x, stages=7)]}, r"soft\[0\].stages = 7 must lie among"),
        (
            {"soft": [Soft(lambda x, u, th: x, weight=[1, 2, 3])]},
            r"soft.0..weight = .* must hold 2 positive numbers",
        ),
        (
            {"soft": [Soft(lambda x, u, th: x, weight=0)]},
            r"soft.0..weight = 0.0 must hold 2 positive",
        ),
        ({"hard": Soft(lambda x, u, th: x)}, r"hard\[0\] = Soft.* write hard=\[Hard\(row\)\]"),
        ({"hard": [Hard(lambda x, u, th: th["alpha"])]}, r"hard\[0\] has a row that depends on"),
        ({"hard": [Hard(lambda x, u, th: u, stages=[3])]}, r"hard\[0\] depends on u, and there"),
        ({"state_lower": 1, "state_upper": 0}, r"state_lower = .* must lie below state_upper"),
        ({"state_upper": [1, 2, 3]}, r"state_upper = .* must hold 2 numbers, one a state"),
        (
            {"soft": Soft(lambda x, u, th: x, each="discs")},
            r"each = .'discs'. must name one table in data",
        ),
        (
            {"soft": Soft(lambda x, u, th, d: x, each="at"), "data": {"at": [1.0]}, **WITH_DATA},
            "data 'at' must be a table",
        ),
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
    with pytest.raises(ValueError, match=r"vector has shape \(2,\); it must be \(5,\)"):
        nmpc.value_hessian_times(nmpc.solve(np.zeros(2), theta), np.zeros(2))
    with pytest.raises(ValueError, match=r"data has no 'wind' .it has none"):
        nmpc.solve(np.zeros(2), theta, data={"wind": 1.0})
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
        ({"soft": Soft(lambda x, u, th: [x[0], -(ca.fabs(x[1]) ** 1.5) - x[0]])}, [-1e300, 0.0],
         "state .* must hold finite numbers"),
    ],
)  # fmt: skip
def test_what_is_not_finite_where_a_plan_begins_is_named(solver, changes, state, message):
    nmpc = Nmpc(problem(**changes), solver=solver)
    with pytest.raises((SolverError, ValueError), match=message) as caught:
        nmpc.solve(np.array(state), nmpc.problem.theta)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "kink"),
    [
        ({"stage": lambda x, u, th: ca.sumsqr(x) + 0.3 * ca.fabs(u)}, "stage has a kink (fabs); "),
        ({"terminal": lambda x, th: ca.fmax(x[0], th["alpha"])}, "terminal has a kink (fmax); "),
        ({"model": lambda x, u, th: ca.sign(x) * ca.fmin(u, 1)}, "model has a kink (fmin, sign); "),
        ({"soft": Soft(lambda x, u, th: ca.if_else(u > 1, u, 1))}, "rows has a kink (if_else); "),
        ({"stage": lambda x, u, th: ca.sumsqr(u) * ca.fmax(th["alpha"], 1)}, ""),  # of theta alone
    ],
)
def test_a_kink_where_a_solve_fails_is_told_how_to_be_written(changes, kink):
    one = problem(**changes)
    why = Nmpc(one, solver="ipopt")._free.diagnosis.why(np.ones(2), one.theta, one.data)
    assert why.startswith(kink)
    assert ("Soft(lambda x, u, th: ca.vertcat(h, -h), weight=w)" in why) == bool(kink)


def test_a_kink_can_be_written_as_rows():
    """|u| as a cost, where plans come to rest at u = 0, is nothing that a solver can do."""
    sharp = problem(stage=lambda x, u, th: ca.sumsqr(x) + 9 * ca.fabs(u), lower=-1, upper=1)
    with pytest.raises(SolverError, match=r"; stage has a kink \(fabs\); .* Soft\("):
        Nmpc(sharp, solver="ipopt").solve(np.array([0.4, 0.2]), sharp.theta)
    rows = Soft(lambda x, u, th: ca.vertcat(u, -u), weight=9)
    same = problem(stage=lambda x, u, th: ca.sumsqr(x), soft=rows, lower=-1, upper=1)
    solution = Nmpc(same, solver="ipopt").solve(np.array([0.4, 0.2]), same.theta)
    assert solution.value == pytest.approx(3 * (0.4**2 + 0.2**2))  # and u = 0


WEIGHED = {
    "theta": {"q": 1.0, "r": 0.1, "root": 0.5, "slope": 0.3, "off": np.eye(2) + 0.1, "a": 0.9},
    "model": lambda x, u, th: th["a"] * x + u,
    "stage": lambda x, u, th: th["q"] * ca.sumsqr(x) + th["r"] * u**2 + th["slope"] * x[0],
    "terminal": lambda x, th: ca.sumsqr(th["root"] * x) + x.T @ th["off"] @ x,
    "lower": -1.0,
    "upper": 1.0,
}


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


def test_numpys_functions_write_what_casadis_do():
    """They need no refusal: np.sin of a symbol is ca.sin of it, as np.where is ca.if_else."""
    ours = problem(
        model=lambda x, u, th: np.array([np.sin(x[0]), np.where(x[1] > 0, x[1], 2 * x[1])]) + u,
        stage=lambda x, u, th: np.linalg.norm(x) ** 2 + np.maximum(u, 0) + np.abs(x[0]),
    )
    same = problem(
        model=lambda x, u, th: ca.vertcat(ca.sin(x[0]), ca.if_else(x[1] > 0, x[1], 2 * x[1])) + u,
        stage=lambda x, u, th: ca.norm_2(x) ** 2 + ca.fmax(u, 0) + ca.fabs(x[0]),
    )
    assert ours.key == same.key


def test_a_state_may_be_alone():
    alone = problem(states=1, theta={"a": 0.9}, model=lambda x, u, th: th["a"] * x + u,
                    stage=lambda x, u, th: x**2 + u**2)  # fmt: skip
    assert Nmpc(alone, solver="ipopt").solve(np.ones(1), alone.theta).states.shape == (4, 1)
    with pytest.raises(ValueError, match=r"model cannot be written down.*out of bounds"):
        problem(states=1, model=lambda x, u, th: x[1])


@pytest.mark.parametrize(
    ("growth", "horizon", "said"),
    [(1.5, 20, "^$"), (1.5, 60, "^model leads to 1e[+]09 in 52 steps at rest: an unstable model"),
     (12.0, 5, "^model makes 1e[+]01 times as much .* an unstable model takes a shorter horizon")],
)  # fmt: skip
def test_what_an_unstable_model_needs_is_a_shorter_horizon(growth, horizon, said):
    steps = problem(states=1, model=lambda x, u, th: growth * x + u, horizon=horizon,
                    stage=lambda x, u, th: x[0] ** 2 + u**2)  # fmt: skip
    why = Nmpc(steps, solver="fatrop")._free.diagnosis.why(np.ones(1), steps.theta, steps.data)
    assert re.search(said, why)


@pytest.mark.usefixtures("interpreted")
def test_substeps_make_a_fast_model_one_that_can_be_planned_with():
    """A motor whose current settles in 1 ms, sampled at 10 ms."""

    def motor(substeps):
        def dynamics(x, u):
            return ca.vertcat((u - 0.5 * x[0] - 0.01 * x[1]) / 1e-3, (x[0] - 0.1 * x[1]) / 0.1)

        return problem(
            theta={"target": 5.0}, horizon=5, lower=-12, upper=12,
            model=lambda x, u, th: rk4(dynamics, x, u, 0.01, substeps=substeps),
            stage=lambda x, u, th: (x[1] - th["target"]) ** 2 + 1e-3 * u**2,
            terminal=lambda x, th: 10 * (x[1] - th["target"]) ** 2,
        )  # fmt: skip

    with pytest.raises(SolverError, match=r"model makes 1e\+01 times .* substeps"):
        Nmpc(motor(1), solver="ipopt").solve(np.array([900.0, 0.0]), motor(1).theta)
    nmpc = Nmpc(motor(8))
    solution = nmpc.solve(np.zeros(2), motor(8).theta)
    ipopt = Nmpc(motor(8), solver=Ipopt(1e-10)).solve(np.zeros(2), motor(8).theta)
    np.testing.assert_allclose(solution.states, ipopt.states, atol=1e-4)
    assert 0 < solution.states[-1, 1] < 6
    assert np.abs(solution.states[:, 0]).max() < 24.1  # [A], 12 V through half an ohm
