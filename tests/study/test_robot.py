"""The public task for Gymnasium, and the NMPC as a policy in it."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from nmpcrl.control import Policy
from nmpcrl.learning import evaluate
from nmpcrl.study import ParameterError, paper
from nmpcrl.study.drawn import TUNE
from nmpcrl.study.robot import RobotEnv

ROBOT = "nmpcrl.gym:nmpcrl/Robot-v0"
THETA = np.array(paper.THETA_INIT)
FORWARD = np.array([0.6, 0.0])


def follow(env, policy, **options):
    """Observations, rewards and the last step of an episode."""
    seen, _ = env.reset(**options)
    states, rewards = [seen], []
    while True:
        seen, reward, terminated, truncated, info = env.step(policy(states[-1]))
        rewards.append(reward)
        if terminated or truncated:
            return np.array(states), np.array(rewards), (terminated, truncated, info)
        states.append(seen)


@pytest.mark.filterwarnings("ignore:.*For Box action spaces:UserWarning")
@pytest.mark.parametrize("layout", [None, "E", "T07", "0.5,2.2 3,0.5"])
def test_gymnasiums_own_checks_pass(layout):
    env = gymnasium.make(ROBOT, layout=layout, render_mode="rgb_array", steps=3)
    check_env(env.unwrapped, skip_render_check=layout is not None)


@pytest.mark.parametrize("layout", ["A", "E"])
def test_the_nmpc_as_a_policy_makes_the_rollout_by_which_theta_is_judged(layout):
    policy = Policy(paper.nmpc(layout), THETA)
    env = gymnasium.make(ROBOT, layout=layout)
    states, rewards, end = follow(env, lambda seen: policy(seen[:3]))
    judged = evaluate(paper.nmpc(layout), THETA, paper.STEPS)
    np.testing.assert_array_equal(states[:, :3], judged.states)
    np.testing.assert_array_equal(states[0], [*paper.START, *np.ravel(paper.LAYOUTS[layout])])
    np.testing.assert_array_equal(-rewards, judged.costs)
    assert end[:2] == (False, True)
    assert len(rewards) == paper.STEPS


def test_layouts_are_drawn_by_seed_actions_clipped_and_observations_stay_in_their_space():
    one, same, other = (RobotEnv() for _ in range(3))
    drawn = [
        [env.reset(seed=seed if first else None)[1]["layout"] for first in (True, *[False] * 9)]
        for env, seed in ((one, 3), (same, 3), (other, 4))
    ]
    assert drawn[0] == drawn[1] != drawn[2]
    assert len({*drawn[0], *drawn[2]}) > 5
    assert {*drawn[0], *drawn[2]} <= set(TUNE.values())
    env, found = RobotEnv("A"), []
    for action in (FORWARD, np.array([9.0, 0.0]), -FORWARD, np.array([0.6, np.pi / 2])):
        states, rewards, _ = follow(env, lambda _, action=action: action)
        assert all(env.observation_space.contains(state) for state in states)
        found.append((states, rewards))
    for one, other in zip(*found[:2], strict=True):
        np.testing.assert_array_equal(one, other)


def begun(env: RobotEnv) -> RobotEnv:
    env.reset()
    return env


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: RobotEnv("Z"), ParameterError, "layout = 'Z' must be one of A to F and T01 to"),
        (lambda: RobotEnv(steps=0), ParameterError, "steps = 0 must be"),
        (lambda: RobotEnv().reset(options={"layout": "1,1"}), ParameterError, "one of 4 obstacles"),
        (
            lambda: begun(RobotEnv("A")).step([np.nan, 0.0]),
            ParameterError,
            "two finite numbers, speed and turn rate",
        ),
        (lambda: RobotEnv("A").step(FORWARD), gymnasium.error.ResetNeeded, "call reset first"),
    ],
)
def test_nonsense_is_refused_in_a_sentence(call, error, message):
    with pytest.raises(error, match=message):
        call()
