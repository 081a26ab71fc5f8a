"""The public tasks for Gymnasium, and the NMPC as a policy in one of them."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from nmpcrl.learning import Persistent, evaluate
from nmpcrl.study import ParameterError, paper
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.robot import NmpcPolicy, RobotEnv

ROBOT = "nmpcrl.gym:nmpcrl/Robot-v0"
THETA = np.array(paper.THETA_INIT)
FORWARD = np.array([0.6, 0.0])
in_its_units = pytest.mark.filterwarnings("ignore:.*For Box action spaces:UserWarning")


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


@in_its_units
@pytest.mark.parametrize("layout", [None, "E", "T07", "0.5,2.2 3,0.5"])
def test_gymnasiums_own_checks_pass(layout):
    env = gymnasium.make(ROBOT, layout=layout, render_mode="rgb_array", steps=3)
    check_env(env.unwrapped, skip_render_check=layout is not None)


@pytest.mark.parametrize("layout", ["A", "E"])
def test_the_nmpc_as_a_policy_makes_the_rollout_by_which_theta_is_judged(layout):
    states, rewards, end = follow(gymnasium.make(ROBOT, layout=layout), NmpcPolicy())
    judged = evaluate(Persistent(paper.nmpc(layout)), THETA, paper.STEPS)
    np.testing.assert_array_equal(states[:, :3], judged.states)
    np.testing.assert_array_equal(-rewards, judged.costs)
    assert end[:2] == (False, True)
    assert len(rewards) == paper.STEPS


def test_a_policy_forgets_its_plan_in_another_layout():
    policy, env = NmpcPolicy(), RobotEnv(steps=5)
    first = follow(env, policy, options={"layout": "A"})[1]
    follow(env, policy, options={"layout": "B"})
    np.testing.assert_array_equal(follow(env, policy, options={"layout": "A"})[1], first)


def test_the_obstacles_are_observed_and_the_start_is_the_papers():
    seen, info = RobotEnv("C").reset()
    np.testing.assert_array_equal(seen, [*paper.START, *np.ravel(paper.LAYOUTS["C"])])
    assert info["layout"] == paper.LAYOUTS["C"]


def test_a_layout_is_drawn_anew_from_those_to_tune_on_and_a_seed_draws_the_same():
    drawn = {}
    for seed in (3, 3, 4):
        env = RobotEnv()
        first = env.reset(seed=seed)[1]["layout"]
        drawn.setdefault(seed, []).append([first, *(env.reset()[1]["layout"] for _ in range(9))])
    assert drawn[3][0] == drawn[3][1] != drawn[4][0]
    found = set(drawn[3][0] + drawn[4][0])
    assert len(found) > 5
    assert found <= set(TUNE.values())
    assert not found & set(JUDGE.values())


def test_an_action_is_clipped_and_an_episode_stays_in_the_space_of_observations():
    env, found = RobotEnv("A"), []
    for action in (FORWARD, np.array([9.0, 0.0]), -FORWARD, np.array([0.6, np.pi / 2])):
        states, rewards, _ = follow(env, lambda _, action=action: action)
        assert all(env.observation_space.contains(state) for state in states)
        found.append((states, rewards))
    for one, other in zip(*found[:2], strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_step_before_a_reset_and_after_the_end_is_refused():
    env = RobotEnv("A", steps=1)
    with pytest.raises(gymnasium.error.ResetNeeded, match="call reset first"):
        env.step(FORWARD)
    env.reset()
    assert env.step(FORWARD)[3]
    with pytest.raises(gymnasium.error.ResetNeeded, match="call reset first"):
        env.step(FORWARD)


def acted(action):
    env = RobotEnv("A")
    env.reset()
    return env.step(action)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: RobotEnv("Z"), "layout = 'Z' must be one of A to F and T01 to T60, or 1 to 16"),
        (lambda: RobotEnv("J001"), "layout = 'J001' must be one of A to F and T01 to T60"),
        (lambda: RobotEnv(steps=0), "steps = 0 must be"),
        (lambda: RobotEnv().reset(options={"layout": "1,1"}), "layout = '1,1' must be one of 4 ob"),
        (lambda: acted([np.nan, 0.0]), "must be two finite numbers, speed and turn rate"),
        (lambda: acted([0.1]), "must be two finite numbers, speed and turn rate"),
    ],
)
def test_nonsense_is_refused_in_a_sentence(call, message):
    with pytest.raises(ParameterError, match=message):
        call()


def test_a_frame_shows_the_robot_where_it_is():
    env = gymnasium.make(ROBOT, layout="A", render_mode="rgb_array")
    env.reset()
    first = env.render()
    for _ in range(10):
        env.step(FORWARD)
    later = env.render()
    assert first.shape == later.shape == (640, 640, 3)
    assert first.dtype == np.uint8
    assert not np.array_equal(first, later)
