"""A controller is a value: pickled or copied it solves alike, and its key says what it is."""

import copy
import pickle
import subprocess
import sys

import casadi as ca
import cloudpickle
import numpy as np
import pytest
from small_problems import limited, plant, tank

from nmpcrl.control import Fatrop, Hard, Ipopt, Nmpc, Plant, Problem, Riccati, Soft, Task
from nmpcrl.control.content import NoContent
from nmpcrl.control.solvers import stages
from nmpcrl.study import paper

ELSEWHERE = """
import pickle, sys
nmpc, state, theta = pickle.loads(sys.stdin.buffer.read())
sys.stdout.buffer.write(pickle.dumps((nmpc.key, nmpc.solve(state, theta))))
"""


THETA = {name: one if np.ndim(one) else float(one) for name, one in
         limited().split(limited().theta).items()}  # fmt: skip
TASK = Task([1.0, 0.0], [0.0, 0.0], [-5, -5], [5, 5], weights=[1.0, 1.0])


class Rough(Riccati):
    """A solver of the user's."""

    def prepare(self, ocp):
        return super().prepare(ocp)


def rewritten(kind: type, method: str, gain: float) -> type:
    """A class with a method that a user wrote, as a cell of a notebook has it."""

    def wrong(self, *arguments, **others):
        return gain * getattr(super(made, self), method)(*arguments, **others)

    made = type(kind.__name__, (kind,), {method: wrong, "__module__": "__main__"})
    return made


def controllers() -> list[tuple[Nmpc, np.ndarray, np.ndarray]]:
    """Of every kind, with a state and theta."""
    return [
        (Nmpc(limited(), solver="ipopt"), np.array([0.1, 0.0]), limited().theta),
        (Nmpc(tank(1e-6), solver=Fatrop(1e-9)), np.array([5e-7, 1e-6]), tank(1e-6).theta),
        (Nmpc(plant(), TASK, 4, solver="ipopt"), np.array([1.0, 0.3]), np.full(6, 0.5)),
        (paper.nmpc(), np.array(paper.START), np.array(paper.THETA_INIT)),
    ]


def same(one, other) -> None:
    """Two solutions, bit for bit."""
    assert one.value == other.value
    assert one.iterations == other.iterations
    np.testing.assert_array_equal(one.features, other.features)
    np.testing.assert_array_equal(one.point, other.point)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
@pytest.mark.parametrize("k", range(4))
def test_a_copy_solves_as_the_original_does_and_a_copied_solution_is_a_warm_start(again, k):
    nmpc, state, theta = controllers()[k]
    before, solution = again(nmpc), nmpc.solve(state, theta)
    for one in (before, again(nmpc), again(again(nmpc))):
        same(one.solve(state, theta), solution)
        assert one.key == nmpc.key
    for action in (None, nmpc.clip(np.full(nmpc.m, 0.1))):
        solution = nmpc.solve(state, theta, action=action)
        copied = again(solution)
        same(copied, solution)
        assert nmpc.kkt_residual(copied) == nmpc.kkt_residual(solution)
        warm, with_copy = (nmpc.solve(state, theta, one, action) for one in (solution, copied))
        assert with_copy.value == pytest.approx(warm.value, rel=1e-9)


def test_another_process_finds_the_same_bits_and_a_copy_or_layout_no_other_machine_code():
    given = controllers()[0]
    asked, command = pickle.dumps(given), [sys.executable, "-c", ELSEWHERE]
    ran = subprocess.run(command, input=asked, capture_output=True, check=True)
    nmpc, state, theta = given
    key, solution = pickle.loads(ran.stdout)
    assert key == nmpc.key
    same(solution, nmpc.solve(state, theta))
    for problem in (nmpc.problem for nmpc, *_ in controllers()):
        assert stages.write(pickle.loads(pickle.dumps(problem))) == stages.write(problem)
    robots = paper.nmpc(), paper.nmpc("B"), paper.nmpc(horizon=25, gamma=0.9)
    tanks = (tank(1e-6, horizon=N, gamma=gamma).solved for N, gamma in ((8, 0.95), (1, 1.0)))
    for problems in ((nmpc.problem for nmpc in robots), tanks):
        assert len({stages.write(problem) for problem in problems}) == 1


def test_a_key_says_what_a_user_wrote_and_any_other_number_or_name_is_another_key():
    """With all that his code reads, and not where it stands."""
    one, again = (rewritten(Nmpc, "solve", 1)(limited()) for _ in range(2))
    assert one.key == again.key == pickle.loads(cloudpickle.dumps(one)).key
    again.bias = 0.5
    assert again.key != one.key
    plain = Nmpc(limited())
    plain.solve = lambda *_: None
    assert plain.key != Nmpc(limited()).key
    plain.solve = np.random.default_rng(0)
    with pytest.raises(NoContent, match="a Generator"):
        _ = plain.key
    assert Nmpc(limited()).key == Nmpc(limited()).key
    assert len(Nmpc(limited()).key) == 64
    assert plant().key == plant().key
    changed = [
        {}, {"gamma": 0.9500000001}, {"lower": -1.49}, {"terminal": None},
        {"data": {"wind": 0.1, "target": np.zeros(2)}},
        {"theta": THETA | {"Q": np.eye(2)}}, {"theta": THETA | {"r": 0.2000000001}},
        {"state_lower": [-2.0, -0.61]}, {"hard": ()}, {"scale": [2.0, 1.0]},
        {"soft": [Soft(lambda x, u, th, d: x[0] - th["limit"][1], weight=1.1)]},
        {"soft": [Soft(lambda x, u, th, d: x[0] - th["limit"][1], weight=1.0, stages=[2])]},
        {"hard": Hard(lambda x, u, th, d: x[0] + u - 3.1)},
        {"stage": lambda x, u, th, d: ca.sumsqr(x) / 3 + 0.1 * ca.sumsqr(2 * u)},
        *({"kind": rewritten(Problem, "stage_data", gain)} for gain in (1, 2)),
    ]  # fmt: skip
    solvers = Fatrop(), Ipopt(), Riccati(1e-9), Riccati(starts=3), Rough(), Rough(starts=3)
    others = [Nmpc(limited(**one)) for one in changed]
    others += [Nmpc(limited(), solver=how) for how in solvers]
    others += [Nmpc(limited(), ties_active=True), paper.nmpc(), paper.nmpc("B")]
    others += [paper.nmpc(horizon=9), paper.nmpc(box="soft")]
    others += [Nmpc(plant(), TASK, **how) for how in ({}, {"gamma": 0.9}, {"slack_weight": 9})]
    others += [Nmpc(plant(period=0.1), TASK)]
    others += [rewritten(Nmpc, "solve", gain)(limited()) for gain in (1, 2)]
    others += [Nmpc(plant(rewritten(Plant, "step", gain)), TASK) for gain in (1, 2)]
    assert len({one.key for one in others}) == len(others)
