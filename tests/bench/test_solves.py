"""What is solved and counted; how fast, no test says."""

import numpy as np
import pytest

from nmpcrl.bench import baselines, solves
from nmpcrl.control import Riccati, SolverError
from nmpcrl.study import paper

THETA = solves.THETA
STEPS = 4
NMPC = paper.nmpc(solver=Riccati(starts=1))  # as the baselines, from standing still alone


each_baseline = pytest.mark.parametrize(
    "write", [baselines.mx, baselines.rebuilt], ids=["mx", "rebuilt"]
)
INSIDE = np.array([-0.5, 1.5, 0.0])  # the rim of an obstacle, where the slacks are at work


@each_baseline
@pytest.mark.parametrize("state", [np.array(paper.START), INSIDE], ids=["start", "inside"])
def test_the_baselines_have_the_value_gradient_and_plan_of_the_problem(write, state):
    ours, theirs = NMPC.solve(state, THETA), write(NMPC)(state, THETA, None)
    assert theirs.value == pytest.approx(ours.value, rel=1e-6)
    assert theirs.features[:-1] == pytest.approx(ours.features[:-1], rel=1e-4, abs=1e-4)
    states, inputs, _ = theirs.variables
    assert states == pytest.approx(ours.states.T, abs=1e-3)
    assert inputs == pytest.approx(ours.inputs.T, abs=1e-3)


@each_baseline
def test_the_baselines_start_from_the_last_plan(write):
    solve = write(NMPC)
    first = solve(NMPC.task.start, THETA, None)
    later = NMPC.plant.step(NMPC.task.start, first.variables[1][:, 0])
    again = solve(later, THETA, first)
    assert again.iterations < first.iterations
    assert again.value == pytest.approx(NMPC.solve(later, THETA).value, rel=1e-6)


def test_all_solvers_find_the_same_optima_near_the_start():
    table = solves.compare(solves.solvers(), NMPC, steps=STEPS)
    names = ("riccati", "fatrop", "ipopt", "ipopt MX", "rebuilt")
    assert [*table.index] == [(loop, name) for loop in solves.LOOPS for name in names]
    assert (table[["worse", "failed"]] == 0).all(axis=None)
    assert (table.iterations >= 1).all()
    assert (table["median"] <= table.p95).all()
    assert (table.p95 <= table["max"]).all()
    assert (table.times.loc[:, "riccati"] == 1).all()


class Dear:
    """A plan that costs half as much again."""

    def __init__(self, solution):
        self.value, self.iterations = 1.5 * solution.value, 1


def test_a_dearer_plan_is_worse_and_none_a_failure_after_which_a_solver_starts_anew():
    warm_starts = []

    def fails(state, theta, warm_start):
        warm_starts.append(warm_start)
        if len(warm_starts) % 2:
            return NMPC.solve(state, theta)
        raise SolverError("no", state, theta)

    named = {
        "sound": NMPC.solve,
        "dear": lambda state, theta, _: Dear(NMPC.solve(state, theta)),
        "fails": fails,
    }
    table = solves.compare(named, NMPC, steps=STEPS).loc["without noise"]
    assert dict(table.worse) == {"sound": 0.0, "dear": 1.0, "fails": 0.0}
    assert table.failed["sound"] == table.failed["dear"] == 0.0
    assert table.failed["fails"] == pytest.approx(1 / 3)  # of those after the first
    assert warm_starts[2] is None
    assert warm_starts[3] is not None
