"""Gauss-Newton on the cost of the closed loop, held to finite differences of whole episodes."""

import numpy as np
import pytest
from learning.small_runs import THETA, differences, noise

from nmpcrl.control import Nmpc, SolverError, Task, differential_drive
from nmpcrl.learning import Exploration, TrustRegion, Weights, evaluate, train
from nmpcrl.learning.gauss_newton import closed_loop

STEPS = 12


class Recorder:
    """An optimiser that keeps the gradient and the curvature and moves nothing."""

    def __call__(self, theta, gradient, curvature):
        self.gradient, self.curvature = gradient, curvature
        return theta


@pytest.fixture(scope="module")
def free() -> Nmpc:
    """The paper's robot without obstacles, at rest near its target."""
    far = np.full(3, 9.0)
    return Nmpc(differential_drive(), Task([0.3, 0.2, 0.4], np.zeros(3), -far, far))


def charged(x, u, d):
    return (x - 1) ** 2 + 0.3 * u**2 + d["price"] * u


def filling(state, action, rng):
    later = 0.9 * state + 0.5 * action - 0.1 * state**2
    return later, charged(*state, *action, {"price": 0.1}), False


TANK = {"plant": filling, "start": [0.2]}


def one_episode(nmpc, theta, explore, cost=None, **world):
    """The summed cost, and the gradient and curvature of J that GN-J makes of the episode."""
    optimiser = Recorder()
    learner = closed_loop(nmpc, optimiser, cost=cost)
    steps = list(train(learner, nmpc, Weights(theta), explore, **world))
    return sum(step.cost for step in steps), optimiser.gradient, optimiser.curvature


PUSHED = Exploration(np.array([[[9.0, 9.0], [0.0, 0.0]]]), np.ones((1, 2)))


@pytest.mark.parametrize(
    ("name", "explore", "world"),
    [
        ("free", noise(1, STEPS, deviation=0.02), {}),
        ("free", PUSHED, {}),  # an input that noise took to its bound does not answer to theta
        ("tank", noise(1, STEPS, 1, deviation=0.05), TANK | {"cost": charged}),
    ],
)
def test_the_gradient_of_j_is_that_of_finite_differences(request, name, explore, world):
    """Of the cost of whole episodes, noise held."""
    nmpc = request.getfixturevalue(name)
    theta = THETA + 0.1 if nmpc.task else nmpc.problem.theta
    _, gradient, _ = one_episode(nmpc, theta, explore, **world)
    slopes = differences(lambda theta: one_episode(nmpc, theta, explore, **world)[0], theta)
    np.testing.assert_allclose(gradient, slopes, rtol=2e-3, atol=2e-5)


def test_the_curvature_of_j_is_that_of_the_sensitivities(free):
    """2 S' diag(Q) S over the visited states, with S by finite differences of whole episodes."""
    *_, curvature = one_episode(free, THETA + 0.1, noise(1, STEPS, deviation=0.0))
    S = differences(lambda theta: evaluate(free, theta, STEPS).states, THETA + 0.1)
    wanted = 2 * np.einsum("itn,n,jtn->ij", S, free.task.weights, S)
    np.testing.assert_allclose(curvature, wanted, rtol=5e-3, atol=1e-5 * np.abs(wanted).max())


@pytest.mark.parametrize("place", [[0.3, 0.2, 0.4], [-8.9, 1.0, 0.0]])
def test_the_feedback_of_the_policy_is_that_of_finite_differences(free, place):
    plan = free.solve(place, THETA)
    slopes = differences(lambda s: free.solve(s, THETA, plan).action, np.array(place), 1e-5)
    np.testing.assert_allclose(free.policy_feedback(plan), slopes.T, rtol=1e-3, atol=1e-4)


def test_an_episode_after_one_that_failed_or_was_left_is_as_it_is_alone(free, monkeypatch):
    both, calls = noise(2, STEPS, deviation=0.02), iter(range(1000))
    alone = Exploration(both.noise[1:], both.scale[1:])
    _, *wanted = one_episode(free, THETA, alone)
    optimiser, solve = Recorder(), Nmpc.solve

    def failing(*given, **more):  # at the plan of t = 4; one solve a step
        if next(calls) == 4:
            raise SolverError("broken", np.zeros(3), THETA)
        return solve(*given, **more)

    monkeypatch.setattr(Nmpc, "solve", failing)
    learner = closed_loop(free, optimiser)
    steps = list(train(learner, free, Weights(THETA), both))
    assert [step.time for step in steps if step.failure] == [4]
    np.testing.assert_array_equal(optimiser.gradient, wanted[0])
    np.testing.assert_array_equal(optimiser.curvature, wanted[1])
    list(train(learner, free, steps[2].weights, alone))
    np.testing.assert_array_equal(optimiser.gradient, wanted[0])


def test_gauss_newton_on_j_asks_for_the_cost_of_a_problems_environment(tank):
    region = TrustRegion(1.0, np.ones(2))
    with pytest.raises(ValueError, match=r"says nothing of the cost .* give cost=\(x, u\) -> l"):
        closed_loop(tank, region)
    with pytest.raises(ValueError, match=r"cost is called as cost\(x, u, d\)"):
        closed_loop(tank, region, cost=lambda x: x)
