"""`Nmpc.solve_many`: the solutions of `solve` to the last bit, and Ipopt's to its tolerance."""

import numpy as np
import pytest
import torch
from differences import active
from small_problems import limited, pendulum, tank

from nmpcrl.control import Ipopt, Nmpc, Riccati, SolverError
from nmpcrl.torch import Layer

COUNT = 8
PARTS = ("value", "features", "point", "iterations", "violation", "restarts", "status", "action")


def drawn(nmpc: Nmpc, count: int = COUNT, seed: int = 0):
    """States, thetas, actions and data of a batch."""
    rng, of = np.random.default_rng(seed), nmpc.problem
    states = rng.normal(size=(count, nmpc.n)) * of.sizes[0]
    thetas = of.theta * rng.uniform(0.9, 1.1, (count, of.theta.size))
    data = None
    if of.data_names:
        data = {"wind": rng.normal(scale=0.05, size=(count, 7)), "target": rng.normal(size=2)}
    return states, thetas, rng.uniform(nmpc.lower, nmpc.upper, (count, nmpc.m)), data


def same(batch, solutions) -> None:
    for name in PARTS:
        expected = np.array([getattr(one, name) for one in solutions])
        assert np.array_equal(getattr(batch, name), expected), name


@pytest.mark.parametrize(
    "controller",
    [Nmpc(pendulum()), Nmpc(tank(1e6)), Nmpc(pendulum(), solver="fatrop")],
    ids=["riccati", "riccati in other units", "fatrop"],
)
def test_a_batch_holds_what_solve_finds(controller):
    states, thetas, actions, data = drawn(controller)
    each = [None] * COUNT
    if data:
        each = [{**data, "wind": data["wind"][k]} for k in range(COUNT)]

    def alone(states, thetas, warm, actions=(None,) * COUNT):
        given = zip(states, thetas, warm, actions, each, strict=True)
        return [controller.solve(s, th, w, a, data=d) for s, th, w, a, d in given]

    free = controller.solve_many(states, thetas, data=data, threads=2)
    one_by_one = alone(states, thetas, [None] * COUNT)
    same(free, one_by_one)
    fixed = controller.solve_many(states, thetas, free, actions, data)
    fixed_one_by_one = alone(states, thetas, one_by_one, actions)
    same(fixed, fixed_one_by_one)
    later = np.vstack([states[:4], free.states[4:, 1]])  # warm starts as they are, and shifted
    moved = controller.solve_many(later, 1.01 * thetas, fixed, data=data, threads=1)
    same(moved, alone(later, 1.01 * thetas, fixed_one_by_one))
    assert np.array_equal(moved[2].states, moved.states[2])
    assert (free.value <= fixed.value + 1e-6 * np.abs(free.value)).all()


def test_what_cannot_be_solved_is_marked_and_leaves_the_others_alone():
    nmpc = Nmpc(limited(), solver="fatrop")  # whose hard rows no plan from the second state keeps
    states = np.array([[0.1, 0.0], [0.0, 9.0], [np.nan, 0.0], [0.2, 0.0]])
    batch = nmpc.solve_many(states, nmpc.problem.theta)
    assert batch.status.tolist() == ["solved", "failed", "refused", "solved"]
    assert np.isnan(batch.value[1:3]).all()
    assert np.isnan(batch.inputs[1:3]).all()
    assert batch[3].value == nmpc.solve(states[3], nmpc.problem.theta).value
    with pytest.raises(SolverError, match="failed"):
        batch[1]
    assert nmpc.solve_many(states[[0, 0, 0, 3]], nmpc.problem.theta, batch).solved.all()
    beyond = nmpc.solve_many(states, nmpc.problem.theta, actions=[7.0])
    assert (beyond.status == "refused").all()


def test_a_shape_is_refused_with_the_one_to_give():
    nmpc = Nmpc(pendulum())
    states, thetas, actions, _ = drawn(nmpc, 3)
    for given, said in (
        ((states[0], thetas), r"states has shape \(2,\); it must be \(B, 2\)"),
        ((states, thetas[:2]), r"thetas has shape \(2, 10\); it must be \(3, 10\) or \(10,\)"),
        ((states, thetas, None, actions[:2]), r"actions has shape \(2, 1\)"),
        ((states, thetas, nmpc.solve_many(states[:2], thetas[:2])), "2 rows; states has 3"),
        ((states, thetas, None, None, {"wind": np.zeros((2, 7))}), r"it must be \(\) or \(3, 7\)"),
        ((states, thetas, None, None, None, 0), "threads = 0 must be a whole number, 1 or more"),
    ):
        with pytest.raises(ValueError, match=said):
            nmpc.solve_many(*given)


@pytest.mark.weekly
@pytest.mark.parametrize("make", [pendulum, limited])
def test_200_plans_are_ipopts_and_their_slopes_in_a_layer_are_differences(make):
    """dV and a sum over the plan along a direction of states, thetas and data at once."""
    nmpc, ipopt = Nmpc(make(), solver=Riccati(1e-11)), Nmpc(make(), solver=Ipopt(1e-10))
    states, thetas, _, data = drawn(nmpc, 200)
    parts, rng, step = [0.4 * states, thetas, data["wind"]], np.random.default_rng(1), 1e-5
    along = [rng.normal(size=part.shape) for part in parts]
    weights, tried, missed = rng.normal(size=(200, 6, 1)), 0, 0

    def solved(by, warm=None):
        states, thetas, wind = (part + by * way for part, way in zip(parts, along, strict=True))
        return nmpc.solve_many(states, thetas, warm, data=data | {"wind": wind})

    here = solved(0.0)
    above, below = solved(step, here), solved(-step, here)
    given = [torch.tensor(part, requires_grad=True) for part in parts]
    value, _, plan = Layer(nmpc)(*given[:2], {"wind": given[2], "target": data["target"]})
    numbers = value, (torch.tensor(weights) * plan).sum((1, 2))
    slopes = []
    for number in numbers:
        grads = torch.autograd.grad(number.nansum(), given, retain_graph=True)
        slopes.append(sum((g.numpy() * a).sum(1) for g, a in zip(grads, along, strict=True)))
    for k in np.flatnonzero(here.solved & (here.violation == 0)):
        at = {"wind": data["wind"][k], "target": data["target"]}
        other = ipopt.solve(parts[0][k], thetas[k], here[k], data=at)
        assert here.value[k] == pytest.approx(other.value, rel=1e-7)
        kind = active(here[k])
        if kind is not None and {active(above[k]), active(below[k])} == {kind}:
            tried += 1
            assert here.inputs[k] == pytest.approx(other.inputs, abs=1e-4)
            by_plan = (weights[k] * (above.inputs[k] - below.inputs[k])).sum()
            expected = np.array([above.value[k] - below.value[k], by_plan]) / (2 * step)
            missed += [slopes[0][k], slopes[1][k]] != pytest.approx(expected, rel=1e-4, abs=1e-4)
    assert tried > 100
    assert missed <= 2  # next to a kink, where the error of a solve shows in a difference
