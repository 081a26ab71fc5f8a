"""Gymnasium in both directions."""

from itertools import pairwise

import casadi as ca
import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box
from gymnasium.utils.env_checker import check_env
from learning.small_runs import noise, run

from nmpcrl.control import Ipopt, Nmpc, Problem
from nmpcrl.learning import as_gymnasium, evaluate, expected_sarsa


@pytest.fixture(scope="module")
def car() -> Nmpc:
    """Gymnasium's MountainCarContinuous, planned with another hill."""
    problem = Problem(
        states=2, inputs=1, horizon=10, gamma=0.99, lower=-1, upper=1, theta={"hill": 0.002},
        model=lambda x, u, th: ca.vertcat(
            x[0] + x[1], x[1] + 0.0015 * u - th["hill"] * ca.cos(3 * x[0])
        ),
        stage=lambda x, u, th: ca.sumsqr(x[0] - 0.45) + 0.1 * ca.sumsqr(u),
    )  # fmt: skip
    return Nmpc(problem, solver=Ipopt())


class Slow(gymnasium.Env):
    """x+ = x + u + noise from a random start; terminated beyond 1, truncated after 6 steps."""

    def __init__(self, bound=1, dtype=np.float32):
        self.observation_space = Box(-9, 9, (2,), np.float32)
        self.action_space = Box(-bound, bound, (1,), dtype)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.time, self.x = 0, self.np_random.uniform(-0.5, 0.5, 2).astype(np.float32)
        return self.x, {}

    def step(self, action):
        assert (action.dtype, action.shape) == (np.float32, (1,))
        self.time += 1
        self.x = self.x + action + self.np_random.normal(scale=0.01, size=2).astype(np.float32)
        return self.x, float(self.x[0]) - 2, bool(self.x[0] > 1), self.time == 6, {}


def trained(nmpc, plant, rng=0, shape=(3, 10)):
    explore = noise(*shape, nmpc.m, deviation=0.1)
    return run(expected_sarsa(nmpc, 1e-7), nmpc, explore, plant=plant, rng=rng)


def test_a_gymnasium_environment_is_a_plant_that_ends_and_whose_seeds_the_generator_draws(car):
    steps = trained(car, Slow(), shape=(10, 10))
    for step, later in pairwise(steps):
        if not step.last:
            assert abs(later.state - step.state - step.action).max() < 0.1
            assert step.cost == pytest.approx(2 - later.state[0])
    ends = [step for step in steps if step.last]
    assert {step.end for step in ends} == {True, False}
    for step in ends:
        assert step.end or step.time == 5
        assert (step.update.successor.value == 0) == step.end
    first, again, other = ([s.state for s in trained(car, Slow(), rng=rng)] for rng in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first[0], other[0])
    assert len({tuple(step.state) for step in trained(car, Slow()) if step.time == 0}) == 3


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        (lambda: gymnasium.make("Pendulum-v1"), {}, "observation_space = .* must be a Box of 2 nu"),
        (lambda: gymnasium.make("MountainCar-v0"), {}, r"= Discrete\(3\) must be a Box"),
        (lambda: Slow(0.5), {}, r"between \[-0.5\] and \[0.5\], .* \[-1.\] and"),
        (lambda: Slow(9, int), {}, "action_space = .*int.* must hold floats"),
        (Slow, {"start": [0.0, 0.0]}, "draws its own start: leave start= out"),
    ],
)
def test_an_environment_of_another_kind_is_refused(car, make, options, message):
    with pytest.raises(ValueError, match=message):
        evaluate(car, car.problem.theta, 5, plant=make(), **options)


@pytest.mark.filterwarnings("ignore:.*Box observation space:UserWarning")
@pytest.mark.filterwarnings("ignore:.*For Box action spaces:UserWarning")
def test_ours_pass_gymnasiums_own_check(robot, car):
    check_env(as_gymnasium(robot, steps=5), skip_render_check=True)

    def hilly(state, action, rng):
        return state + rng.normal(scale=0.01, size=2), 1.0, state[0] > 3

    env = as_gymnasium(car, plant=hilly, start=lambda rng: rng.uniform(-1, 1, 2))
    check_env(env, skip_render_check=True)


def test_an_environment_of_ours_takes_an_agents_own_numbers_and_is_truncated_after_its_steps(robot):
    env, given = as_gymnasium(robot, steps=3), np.array([0.5, -0.25], np.float32)
    found = []
    for action in (given, given.tolist(), given.astype(float)):
        env.reset(seed=0)
        states, _, *ends, _ = zip(*(env.step(action) for _ in range(3)), strict=True)
        assert ends == [(False, False, False), (False, False, True)]
        assert states[0].dtype == float
        found.append(states)
    np.testing.assert_array_equal(found, [found[0]] * 3)
