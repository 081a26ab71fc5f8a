"""All solvers: warm starts help, every solve ends, maxima are left; and CasADi's alone."""

import pickle
import subprocess
import sys
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Nmpc, Problem, Soft, SolverError, Status, differential_drive
from nmpcrl.control.nmpc import ABSURD
from nmpcrl.study import paper

CASADI_SOLVERS = ("fatrop", "ipopt")
of_casadi = pytest.mark.parametrize("solver", CASADI_SOLVERS)  # to these the box is hard


def test_along_a_closed_loop_warm_starts_save_iterations_and_change_nothing(robot, theta):
    """In the next state, and in the same one with another theta and u_0 fixed before."""
    state, warm_start, warm, cold = robot.task.start, None, 0, 0
    for _ in range(40):
        warm_start, without = robot.solve(state, theta, warm_start), robot.solve(state, theta)
        fixed = robot.solve(state, 1.001 * theta, warm_start, without.action)
        again = robot.solve(state, theta, fixed)
        for one in (warm_start, again):
            assert one.value == pytest.approx(without.value, rel=1e-7)
            warm, cold = warm + one.iterations, cold + without.iterations
        state = robot.plant.step(state, warm_start.action)
    assert warm < 0.8 * cold


@pytest.mark.parametrize("other", ["horizon", "obstacles"])
def test_a_warm_start_of_another_shape_is_refused(fatrop, theta, other):
    task = paper.task()
    fewer = replace(task, obstacles=task.obstacles[:2]) if other == "obstacles" else task
    stranger = Nmpc(differential_drive(), fewer, horizon=9 if other == "horizon" else 10)
    warm_start = stranger.solve(task.start, theta)
    with pytest.raises(ValueError, match=r"the warm start has states of shape .* this problem's"):
        fatrop.solve(task.start, theta, warm_start)


def test_a_solve_changes_no_argument_and_gives_the_same_bits_again(robot, theta):
    state = robot.task.start
    warm_start = robot.solve(state, theta)
    before = warm_start.point.copy()
    moved, changed = state + 0.1, 1.1 * theta
    one, other = (robot.solve(moved, changed, warm_start) for _ in range(2))
    np.testing.assert_array_equal(moved, state + 0.1)
    np.testing.assert_array_equal(changed, 1.1 * theta)
    np.testing.assert_array_equal(warm_start.point, before)
    moved += 1  # nor does the solution change with an argument that is used again
    np.testing.assert_array_equal(one.state, state + 0.1)
    assert one.value == other.value
    np.testing.assert_array_equal(one.features, other.features)
    np.testing.assert_array_equal(one.point, other.point)


@of_casadi
def test_where_there_is_no_solution_the_error_says_so_and_the_next_solve_is_as_before(robot, theta):
    before, state = robot.solve(robot.task.start, theta), np.array([50.0, 1.0, 0.0])
    with pytest.raises(SolverError) as caught:
        robot.solve(state, theta)
    error, arrived = caught.value, pickle.loads(pickle.dumps(caught.value))
    assert str(arrived) == str(error)
    for one in (error, arrived):  # from another process
        np.testing.assert_array_equal(one.state, state)
        np.testing.assert_array_equal(one.theta, theta)
        assert robot.solver.name in one.status
        assert one.status in str(one)
        assert "[50.  1.  0.]" in str(one)
        assert "\n" not in str(one)
    after = robot.solve(robot.task.start, theta)
    np.testing.assert_array_equal(after.primal, before.primal)


def test_a_solve_that_fails_never_returns_numbers(robot, draw):
    """Iterations run out on purpose: whatever comes back must be finite, or be an error."""
    rng, solved = np.random.default_rng(23), 0
    for state, _ in draw(30, seed=23):
        theta = rng.choice([-1, 1], 9) * 10 ** rng.uniform(-4, np.log10(ABSURD), 9)
        try:
            solution = robot.solve(state, theta)
        except SolverError:
            continue
        solved += 1
        assert np.isfinite([solution.value, *solution.features]).all()
        assert (np.abs(solution.inputs) <= robot.plant.upper).all()
    assert solved > 0


ENDLESS = """
import sys
import numpy as np
from nmpcrl.control import SolverError
from nmpcrl.study import paper

nmpc, rng = paper.nmpc(solver=sys.argv[1]), np.random.default_rng(0)
for exponent in np.arange(1.0, 6.5, 0.25):
    for _ in range(2):
        state = np.append(rng.uniform(-1, 1, 2), 0) * 10**exponent
        try:
            nmpc.solve(state, np.array(paper.THETA_INIT))
            print("solved")
        except (SolverError, ValueError) as error:
            print(type(error).__name__)
"""


@pytest.mark.slow
def test_from_however_far_outside_the_box_a_solve_ends(solver):
    """In a process of its own: a solver that never returns cannot be interrupted from Python."""
    command = [sys.executable, "-c", ENDLESS, solver]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    failed, solved = (ended.stdout.count(word) for word in ("SolverError", "solved"))
    assert failed > 5 if solver in CASADI_SOLVERS else (failed == 0 and solved > 10)
    assert ended.stdout.count("ValueError") > 0


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize("act", [ca.fabs, lambda u: u**2, lambda u: 2 - 2 * ca.cos(u)])
@pytest.mark.parametrize("soft", [(), [Soft(lambda x, u, th: x - 50.0)]])
def test_no_plan_stays_at_a_maximum(solver, act, soft):
    """At u = 0 nothing changes a store that leaks half to first order; the value there is 13.76."""
    problem = Problem(
        states=1, inputs=1, horizon=3, gamma=0.9, theta={"target": 2.0}, lower=-3.0, upper=3.0,
        model=lambda x, u, th: 0.5 * x + act(u), stage=lambda x, u, th: (x - th["target"]) ** 2,
        terminal=lambda x, th: (x - th["target"]) ** 2, soft=soft,
    )  # fmt: skip
    nmpc = Nmpc(problem, solver=solver)
    empty = nmpc.solve(np.zeros(1), np.zeros(1))
    assert empty.value == pytest.approx(0.0, abs=1e-6)
    for warm_start in (None, empty)[: 1 + (solver in CASADI_SOLVERS)]:  # riccati trusts the other
        assert nmpc.solve(np.zeros(1), np.full(1, 2.0), warm_start).value == pytest.approx(4.0)


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize(
    ("cost", "price"),
    [(1, 0.5), (1, 2.5), *((1, 10.0**k) for k in range(3, 13, 3)), (1e-9, 1e-9), (1e-9, 1.0),
     (1e-6, 1e-3), (1e6, 1e9), (1e9, 1e9)],
)  # fmt: skip
def test_prices_and_costs_may_be_of_any_size(solver, cost, price):
    """min cost (u - 2)^2 + price max(0, u - 1): up to 1 costs no more than 2 cost a unit."""
    problem = Problem(
        states=1, inputs=1, horizon=1, theta={"goal": 2.0, "most": 1.0},
        model=lambda x, u, th: u, stage=lambda x, u, th: cost * (u - th["goal"]) ** 2,
        soft=[Soft(lambda x, u, th: x - th["most"], weight=price, stages=-1)], lower=-5, upper=5,
    )  # fmt: skip
    u = max(1.0, 2 - price / cost / 2)
    one = Nmpc(problem, solver=solver).solve(np.zeros(1), problem.theta)
    np.testing.assert_allclose(one.action, u, atol=1e-6)
    assert one.value == pytest.approx(cost * (u - 2) ** 2 + price * (u - 1), rel=1e-6)
    slope = 2 * cost * (2 - u)
    np.testing.assert_allclose(one.features, [slope, -slope], rtol=1e-5)


def test_where_fatrop_finds_no_plan_ipopt_takes_over_and_is_named():
    """From -2 fatrop makes 27 iterations, the last 16 of them at the optimum."""
    problem = Problem(
        states=1, inputs=1, horizon=1, gamma=0.7, theta={"a": 0.8, "least": 0.2},
        model=lambda x, u, th: th["a"] * x + ca.sin(u), terminal=lambda x, th: 5 * x**2,
        stage=lambda x, u, th: x**2 + (0.3 * u + 0.1) * u, lower=-1.5, upper=1.0,
        soft=[Soft(lambda x, u, th: th["least"] - x, weight=2.0),
              Soft(lambda x, u, th: u - 0.4 + x * th["least"], weight=3.0, stages=0)],
    )  # fmt: skip
    fatrop, ipopt = (Nmpc(problem, solver=name) for name in ("fatrop", "ipopt"))
    taken_over = 0
    for state in np.linspace(-2.0, 2.0, 21):
        one, other = (nmpc.solve(np.array([state]), problem.theta) for nmpc in (fatrop, ipopt))
        assert one.value == pytest.approx(other.value, rel=1e-6)
        assert one.status == (Status.SOLVED if one.solver == "fatrop" else Status.TAKEN_OVER)
        taken_over += one.solver == "ipopt"
    assert 0 < taken_over < 21
