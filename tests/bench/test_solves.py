"""What the benchmark solves and counts; how fast, no test says."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.bench import baselines, learners, scaling, solves
from nmpcrl.control import Riccati, SolverError
from nmpcrl.study import paper

THETA = solves.THETA
STEPS = 4


@pytest.fixture(scope="module")
def nmpc():
    return paper.nmpc(solver=Riccati(starts=1))  # as the baselines, from standing still alone


each_baseline = pytest.mark.parametrize(
    "write", [baselines.mx, baselines.rebuilt], ids=["mx", "rebuilt"]
)
INSIDE = np.array([-0.5, 1.5, 0.0])  # the rim of an obstacle, where the slacks are at work


@each_baseline
@pytest.mark.parametrize("state", [np.array(paper.START), INSIDE], ids=["start", "inside"])
def test_the_baselines_have_the_value_gradient_and_plan_of_the_problem(nmpc, write, state):
    ours, theirs = nmpc.solve(state, THETA), write(nmpc)(state, THETA, None)
    assert theirs.value == pytest.approx(ours.value, rel=1e-6)
    assert theirs.features[:-1] == pytest.approx(ours.features[:-1], rel=1e-4, abs=1e-4)
    states, inputs, _ = theirs.variables
    assert states == pytest.approx(ours.states.T, abs=1e-3)
    assert inputs == pytest.approx(ours.inputs.T, abs=1e-3)


@each_baseline
def test_the_baselines_start_from_the_last_plan(nmpc, write):
    solve = write(nmpc)
    first = solve(nmpc.task.start, THETA, None)
    later = nmpc.plant.step(nmpc.task.start, first.variables[1][:, 0])
    again = solve(later, THETA, first)
    assert again.iterations < first.iterations
    assert again.value == pytest.approx(nmpc.solve(later, THETA).value, rel=1e-6)


@each_baseline
def test_the_baselines_say_when_there_is_no_optimum(nmpc, write, monkeypatch):
    monkeypatch.setitem(baselines.OPTIONS["ipopt"], "max_iter", 1)
    with pytest.raises(SolverError, match="Maximum_Iterations_Exceeded"):
        write(nmpc)(nmpc.task.start, THETA, None)


@pytest.fixture(scope="module")
def interleaved():
    return pd.DataFrame(solves.interleaved(episodes=1, steps=STEPS))


def test_every_solver_solves_every_problem(interleaved):
    assert len(interleaved) == len(solves.LOOPS) * 5 * STEPS
    counts = interleaved.groupby(["loop", "solver"]).size()
    assert (counts == STEPS).all()
    assert interleaved.seconds.min() > 0
    assert interleaved.iterations.min() >= 1


def test_the_first_solve_of_an_episode_is_not_warm(interleaved):
    assert list(interleaved[interleaved.solver == "fatrop"].warm) == 2 * [False, True, True, True]


def test_every_problem_has_a_best_solver_and_all_agree_near_the_start(interleaved):
    suboptimality = interleaved.suboptimality.to_numpy().reshape(-1, 5)
    assert (suboptimality.min(axis=1) == 0).all()
    assert suboptimality.max() < 1e-6


def test_a_solver_that_fails_is_kept_without_a_value_and_starts_again(nmpc):
    warm_starts = []

    def fails_once(state, theta, warm_start):
        warm_starts.append(warm_start)
        if len(warm_starts) == 2:
            raise SolverError("no", state, theta)
        return nmpc.solve(state, theta, warm_start)

    states = [state for state, _, _ in solves.closed_loop(nmpc, 0.0, np.random.default_rng(0), 3)]
    named = {"sound": nmpc.solve, "fails": fails_once}
    rows = list(solves._episode(states, named, np.random.default_rng(0)))
    failed = [row[3:] for row in rows if row[0] == "fails"]
    assert failed[1] == (None, None)
    assert failed[2][1] == pytest.approx(0, abs=1e-6)
    assert warm_starts[0] is None
    assert warm_starts[2] is None


def test_the_suboptimality_is_relative_to_the_best_value(nmpc):
    class Dear:
        def __init__(self, solution):
            self.value, self.iterations = 1.5 * solution.value, 1

    named = {"sound": nmpc.solve, "dear": lambda s, theta, _: Dear(nmpc.solve(s, theta))}
    rows = solves._episode([nmpc.task.start], named, np.random.default_rng(0))
    assert {row[0]: row[4] for row in rows} == pytest.approx({"sound": 0.0, "dear": 0.5})


def test_the_own_loop_has_both_loops_and_no_cold_solve():
    loop = pd.DataFrame(solves.own_loop(episodes=2, steps=STEPS))
    assert dict(loop.groupby("loop").size()) == dict.fromkeys(solves.LOOPS, 2 * (STEPS - 1))


def test_without_noise_the_loop_is_the_policy_s_own(nmpc):
    rng = np.random.default_rng(0)
    (_, first, _), (state, _, _) = solves.closed_loop(nmpc, 0.0, rng, 2)
    assert state == pytest.approx(nmpc.plant.step(nmpc.task.start, first.action))
    *_, (noisy, _, _) = solves.closed_loop(nmpc, 1.0, rng, 2)
    assert np.abs(noisy - state).max() > 1e-3


def test_a_solve_is_its_compiled_part_and_python(nmpc):
    parts = solves.parts(episodes=1)
    assert len(parts["part"]) == 7
    assert min(parts["seconds"]) > 0


def test_added_obstacles_do_not_change_the_plan():
    few, many = scaling._crowded(1), scaling._crowded(max(scaling.OBSTACLES))
    assert len(many.task.obstacles) == max(scaling.OBSTACLES)
    rng = np.random.default_rng(0)
    for state, solution, _ in solves.closed_loop(few, 0.0, rng, 40):
        assert many.solve(state, THETA).value == pytest.approx(solution.value, rel=1e-6)


def test_every_size_has_as_many_warm_solves():
    table = pd.DataFrame(scaling.solve_times(episodes=1, steps=3))
    counts = table.groupby(["varied", "size"]).size()
    assert list(counts.index) == [
        *(("horizon", size) for size in scaling.HORIZONS),
        *(("obstacles", size) for size in scaling.OBSTACLES),
    ]
    assert (counts == 2).all()


@pytest.mark.slow
def test_learners_are_timed_with_every_solver_and_what_is_missing_is_none():
    columns = solves.columns_of(learners.time_learners(steps=2))
    assert len(columns["solver"]) == 3 * 4
    fits = dict(zip(columns["learner"], columns["ms_per_fit"], strict=True))
    assert fits["ES"] is None
    assert fits["RDES"] > 0


def test_mpcrl_and_es_take_turns():
    pytest.importorskip("mpcrl")
    columns = learners.against_mpcrl(rounds=2, steps=2)
    assert columns["learner"] == 2 * (2 * ["mpcrl"] + 10 * ["ES"])
    assert min(columns["seconds"]) > 0


def test_without_mpcrl_there_is_nothing_to_compare_with(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "nmpcrl.bench.baseline_mpcrl", None)
    assert learners.against_mpcrl(rounds=1, steps=1) == {"learner": [], "seconds": []}
