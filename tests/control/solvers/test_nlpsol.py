"""The solvers: two agree, warm starts help, boundaries have a side, and every solve ends."""

import pickle
import subprocess
import sys

import numpy as np
import pytest

from nmpcrl.control import Nmpc, Obstacle, SolverError, Task, differential_drive
from nmpcrl.control.nmpc import ABSURD
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.study import paper

OMEGA = 100.0
CASADI_SOLVERS = ("fatrop", "ipopt")


@pytest.mark.slow
def test_fatrop_and_ipopt_find_the_same_value_on_a_hundred_problems(controllers, draw):
    """Or another local minimum, as in 3 % of all problems; fatrop gives up on 0.1 %."""
    others, failed = 0, 0
    for state, theta in draw(100, seed=20):
        ipopt = controllers["ipopt"].solve(state, theta)
        try:
            fatrop = controllers["fatrop"].solve(state, theta)
        except SolverError:
            failed += 1
            continue
        if fatrop.value != pytest.approx(ipopt.value, rel=1e-6):
            assert np.abs(fatrop.states - ipopt.states).max() > 1e-2  # elsewhere, not inexact
            others += 1
            continue
        scale = np.abs(ipopt.features).max()
        np.testing.assert_allclose(fatrop.features, ipopt.features, atol=1e-5 * scale)
    assert others <= 8
    assert failed <= 2


def test_a_solve_from_its_own_solution_comes_back_to_it(robot, draw):
    """Mostly: an interior-point method steps back from its warm start and may lose it."""
    same, warm, cold = 0, 0, 0
    for state, theta in draw(20, seed=21):
        first = robot.solve(state, theta)
        again = robot.solve(state, theta, first)
        same += again.value == pytest.approx(first.value, rel=1e-7)
        warm, cold = warm + again.iterations, cold + first.iterations
    assert same >= 17
    assert warm < cold


def test_along_a_closed_loop_warm_starts_save_iterations_and_change_nothing(robot, theta):
    state, warm_start, warm, cold = robot.task.start, None, 0, 0
    for _ in range(40):
        warm_start, without = robot.solve(state, theta, warm_start), robot.solve(state, theta)
        assert warm_start.value == pytest.approx(without.value, rel=1e-7)
        warm, cold = warm + warm_start.iterations, cold + without.iterations
        state = robot.plant.step(state, warm_start.action)
    assert warm < 0.8 * cold


def test_a_warm_start_may_come_from_another_theta_and_from_a_fixed_action(robot, theta):
    state = robot.task.start
    exact = robot.solve(state, theta)
    fixed = robot.solve(state, 1.1 * theta, action=np.array([0.1, -0.5]))
    assert robot.solve(state, theta, fixed).value == pytest.approx(exact.value, rel=1e-7)


@pytest.mark.parametrize("other", ["horizon", "obstacles"])
def test_a_warm_start_of_another_shape_is_refused(fatrop, theta, other):
    task = paper.task()
    if other == "obstacles":
        object.__setattr__(task, "obstacles", task.obstacles[:2])
    stranger = Nmpc(differential_drive(), task, horizon=9 if other == "horizon" else 10)
    warm_start = stranger.solve(task.start, theta)
    with pytest.raises(
        ValueError, match=r"the warm start has states of shape .* this problem's are"
    ):
        fatrop.solve(task.start, theta, warm_start)


def test_solving_does_not_change_the_warm_start_or_the_arguments(robot, theta):
    state = robot.task.start
    warm_start = robot.solve(state, theta)
    before = warm_start.point.copy()
    moved, changed = state + 0.1, 1.1 * theta
    solution = robot.solve(moved, changed, warm_start)
    np.testing.assert_array_equal(moved, state + 0.1)
    np.testing.assert_array_equal(changed, 1.1 * theta)
    np.testing.assert_array_equal(warm_start.point, before)
    moved += 1  # nor does the solution change with an argument that is used again
    np.testing.assert_array_equal(solution.state, state + 0.1)


def test_the_same_solve_gives_the_same_bits(robot, draw):
    for state, theta in draw(5, seed=22):
        one, other = robot.solve(state, theta), robot.solve(state, theta)
        assert one.value == other.value
        np.testing.assert_array_equal(one.features, other.features)
        np.testing.assert_array_equal(one.primal, other.primal)


def beside(count, solver, theta_c=0.1, inward=0.0, angle=1.0, **options):
    """A controller that starts on the boundary of `count` obstacles, or `inward` of it [m]."""
    radius = 1.25 * np.sqrt(1 + theta_c) - inward
    start = np.array([2 + radius * np.cos(angle), 2 + radius * np.sin(angle), 0.3])
    box = np.array([9.0, 9.0, np.inf])
    obstacles = (Obstacle(2.0, 2.0),) * count
    task = Task(start, target=np.array([8.5, 5.0, 1.0]), lower=-box, upper=box, obstacles=obstacles)
    return Nmpc(differential_drive(), task, solver=solver, **options)


@pytest.mark.slow
@pytest.mark.parametrize(("count", "angle"), [(1, 0.3), (3, 1.0)])
def test_on_a_boundary_the_slack_of_stage_zero_is_not_active(solver, theta, count, angle):
    """V has a kink in theta_c there, of omega an obstacle; the side outside is chosen."""
    theta[-1] = 0.1
    features = {}
    for place, inward in {"outside": -1e-4, "on": 0.0, "inside": 1e-4}.items():
        nmpc = beside(count, solver, inward=inward, angle=angle)
        beyond = nmpc.task.overlap(nmpc.task.start) + theta[-1]
        expected = {"outside": beyond < -1e-5, "on": abs(beyond) < 1e-14, "inside": beyond > 1e-5}
        assert expected[place].all()
        solution = nmpc.solve(nmpc.task.start, theta)
        assert nmpc.kkt_residual(solution) < 1e-4
        features[place] = solution.features[-1]
    assert features["on"] == pytest.approx(features["outside"], abs=0.05)
    assert features["inside"] == pytest.approx(features["on"] + count * OMEGA, abs=0.05)


def test_on_a_boundary_both_solvers_return_the_same_features(theta):
    theta[-1] = 0.1
    nmpcs = [beside(2, name) for name in ("fatrop", "ipopt")]
    one, other = (nmpc.solve(nmpc.task.start, theta) for nmpc in nmpcs)
    np.testing.assert_allclose(one.features, other.features, rtol=1e-5, atol=1e-5)


def test_the_kink_is_where_differences_say_it_is(solver, theta):
    """One-sided differences of V in theta_c differ by omega; the features are the lower one."""
    theta[-1] = 0.1
    nmpc, step = beside(1, solver), np.append(np.zeros(8), 1e-4)
    here = nmpc.solve(nmpc.task.start, theta)
    above, below = (nmpc.solve(here.state, theta + d, here).value for d in (step, -step))
    assert (here.value - below) / 1e-4 == pytest.approx(here.features[-1], abs=0.1)
    assert (above - here.value) / 1e-4 == pytest.approx(here.features[-1] + OMEGA, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("count", "angle"), [(1, 0.3), (3, 1.0)])
def test_with_ties_active_the_other_side_of_the_kink_is_chosen(solver, theta, count, angle):
    """The value and the plan stay as they are; the features are those inside, not outside."""
    theta[-1] = 0.1
    solutions = {}
    for active in (False, True):
        nmpc = beside(count, solver, angle=angle, ties_active=active)
        solutions[active] = nmpc.solve(nmpc.task.start, theta)
        assert nmpc.kkt_residual(solutions[active]) < 1e-4
    one, other = solutions[False], solutions[True]
    assert other.value == one.value
    np.testing.assert_array_equal(other.primal, one.primal)
    expected = one.features + np.append(np.zeros(8), count * OMEGA)
    np.testing.assert_allclose(other.features, expected, rtol=1e-12)
    np.testing.assert_array_equal(other.multipliers.obstacles[0], OMEGA)
    np.testing.assert_array_equal(other.multipliers.slacks[0], 0)


def test_with_ties_active_the_features_are_the_upper_difference(solver, theta):
    """Cf. `test_the_kink_is_where_differences_say_it_is`, where they are the lower one."""
    theta[-1] = 0.1
    nmpc, step = beside(1, solver, ties_active=True), np.append(np.zeros(8), 1e-4)
    here = nmpc.solve(nmpc.task.start, theta)
    above, below = (nmpc.solve(here.state, theta + d, here).value for d in (step, -step))
    assert (above - here.value) / 1e-4 == pytest.approx(here.features[-1], abs=0.1)
    assert (here.value - below) / 1e-4 == pytest.approx(here.features[-1] - OMEGA, abs=0.1)


@pytest.mark.parametrize("inward", [-1e-4, 1e-4])
def test_off_a_boundary_ties_do_not_matter(solver, theta, inward):
    theta[-1] = 0.1
    one, other = (
        nmpc.solve(nmpc.task.start, theta)
        for nmpc in (beside(2, solver, inward=inward, ties_active=a) for a in (False, True))
    )
    np.testing.assert_array_equal(other.features, one.features)
    np.testing.assert_array_equal(other.point, one.point)


of_casadi = pytest.mark.parametrize("solver", CASADI_SOLVERS)  # to these the box is hard


@of_casadi
def test_where_there_is_no_solution_the_error_says_so(robot, theta):
    state = np.array([50.0, 1.0, 0.0])
    with pytest.raises(SolverError) as caught:
        robot.solve(state, theta)
    error = caught.value
    np.testing.assert_array_equal(error.state, state)
    np.testing.assert_array_equal(error.theta, theta)
    assert robot.solver.name in error.status
    assert error.status in str(error)
    assert "[50.  1.  0.]" in str(error)
    assert "\n" not in str(error)


def test_the_error_survives_the_way_between_processes(fatrop, theta):
    with pytest.raises(SolverError) as caught:
        fatrop.solve(np.array([50.0, 1.0, 0.0]), theta)
    arrived = pickle.loads(pickle.dumps(caught.value))
    assert str(arrived) == str(caught.value)
    np.testing.assert_array_equal(arrived.theta, theta)


@of_casadi
def test_after_a_failure_the_controller_works_as_before(robot, theta):
    before = robot.solve(robot.task.start, theta)
    with pytest.raises(SolverError):
        robot.solve(np.array([50.0, 1.0, 0.0]), theta)
    after = robot.solve(robot.task.start, theta)
    np.testing.assert_array_equal(after.primal, before.primal)


def test_a_solve_that_fails_never_returns_numbers(robot, draw):
    """Iterations run out on purpose: whatever comes back must satisfy KKT, or be an error."""
    rng = np.random.default_rng(23)
    ended = {"solved": 0, "failed": 0}
    for state, _ in draw(30, seed=23):
        theta = rng.choice([-1, 1], 9) * 10 ** rng.uniform(-4, np.log10(ABSURD), 9)
        try:
            solution = robot.solve(state, theta)
        except SolverError:
            ended["failed"] += 1
            continue
        ended["solved"] += 1
        assert np.isfinite(solution.value)
        assert np.isfinite(solution.features).all()
        assert (np.abs(solution.inputs) <= robot.plant.upper).all()
    assert ended["solved"] > 0


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
    if solver in CASADI_SOLVERS:
        assert ended.stdout.count("SolverError") > 5
    else:
        assert ended.stdout.count("SolverError") == 0
        assert ended.stdout.count("solved") > 10
    assert ended.stdout.count("ValueError") > 0


@pytest.mark.slow
@pytest.mark.parametrize("giver", SOLVERS)
@pytest.mark.parametrize("fixed", [False, True])
def test_a_solution_of_any_solver_is_a_warm_start_for_any_other(
    controllers, robot, draw, giver, fixed
):
    """Also one with u_0 free for one with u_0 fixed, and the other way round."""
    same = 0
    for state, theta in draw(6, seed=24):
        action = np.array([0.2, -0.4])
        first, then = (None, action) if fixed else (action, None)
        warm_start = controllers[giver].solve(state, theta, None, first)
        with_it, without = (robot.solve(state, theta, g, then) for g in (warm_start, None))
        same += with_it.value == pytest.approx(without.value, rel=1e-6)
        after = robot.plant.step(state, warm_start.action)
        later = robot.solve(
            np.clip(after, robot.task.lower, robot.task.upper), theta, warm_start, then
        )
        assert robot.kkt_residual(later) < 1e-4
    assert same >= 5
