"""SAC and TD3 in the robot's task: the same bits twice, every episode counted, no model known.

`tests/golden` holds the answers.
"""

import importlib.util
import sys

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.suite import Robot, followed, judge
from nmpcrl.studies import agents
from nmpcrl.studies.agents import AGENTS, PARTS, SAC, SAC_AND_TD3, SETTINGS, TD3, curve, seen, tuned
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.refusal import Refusal
from nmpcrl.study.robot import RobotEnv

needs_agents = pytest.mark.skipif(
    not importlib.util.find_spec("stable_baselines3"), reason="needs the extra nmpcrl[agents]"
)
LAYOUT = paper.LAYOUTS["A"]
START = np.r_[paper.START, np.ravel(LAYOUT)]


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """One episode of random actions, and few gradient steps after each."""
    monkeypatch.setattr("nmpcrl.studies.agents.RANDOM", 1)


def quick(name):
    return AGENTS[name].with_settings(gradient=0.1, width=8)


def checkpoints_of(name, env, layouts, episodes, seed):
    return agents.trained(name, env, layouts, episodes, seed, **quick(name).settings)


@needs_agents
@pytest.mark.parametrize("name", AGENTS)
def test_two_trainings_give_the_same_bits_however_often_they_are_looked_at(name):
    first, second = (Robot(LAYOUT, 3, seed=5) for _ in range(2))
    at_once = quick(name)(first)
    looked = checkpoints_of(name, second.env(), [LAYOUT], [1, 2, 3], second.seed)
    before = np.random.get_state()[1].copy()  # noqa: NPY002 which nobody else may notice
    actions = []
    for one in looked:
        np.random.default_rng(0).normal()
        actions.append(one.policy(START))
    np.testing.assert_array_equal(at_once(START), actions[-1])
    assert (actions[-1] != actions[0]).any()
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


@needs_agents
def test_episodes_and_steps_are_counted_and_none_is_begun_in_vain():
    robot = Robot(LAYOUT, 3, seed=0)
    checkpoints = [*checkpoints_of("TD3", robot.env(), [LAYOUT], [1, 3], 0)]
    assert [(one.episodes, one.steps) for one in checkpoints] == [(1, 130), (3, 390)]
    assert robot.begun == 3
    assert robot.left == 0


@needs_agents
def test_the_last_checkpoint_is_the_judgement_of_the_suite_by_the_cost_of_all_others():
    found, judged = curve((1, 2), quick("TD3"), "A", 2, 3), judge(quick("TD3"), "A", 3, 2)
    assert found["costs"][-1] == [judged.cost]
    assert found["costs"][0] != found["costs"][-1]
    assert found["initial"] == [judged.initial]
    assert (found["episodes"], found["steps"], found["arrived"]) == (2, 260, ["-", "-"])
    assert (judged.episodes, judged.over) == (2, False)
    robot = Robot(LAYOUT, 1, 3)
    rollout = followed(robot, quick("TD3")(Robot(LAYOUT, 2, 3)))
    charged = sum(map(robot.task.stage_cost, rollout.states, rollout.actions))
    assert judged.cost == pytest.approx(charged, rel=1e-12)


@needs_agents
def test_an_agent_meets_all_the_layouts_it_is_given():
    met = set()

    class Noting(RobotEnv):
        def reset(self, **options):
            met.add(options["options"]["layout"])
            return super().reset(**options)

    layouts = [TUNE["T01"], TUNE["T02"]]
    [*_] = checkpoints_of("TD3", Noting(), layouts, [8], 0)
    assert met == {*layouts}


def test_what_is_seen_is_turned_with_the_robot_and_says_where_target_and_centres_are():
    x, y, _ = paper.TARGET
    target, centre, turned = np.split(seen(np.array([x, y - 2.0, np.pi / 2, x - 3.0, y])), [2, 4])
    np.testing.assert_allclose(target, [0.2, 0], atol=1e-7)  # 2 m ahead
    np.testing.assert_allclose(centre, [0.2, 0.3], atol=1e-7)  # and 3 m to the left
    np.testing.assert_allclose(turned, [0, 1, 0], atol=1e-7)


@needs_agents
def test_a_share_of_the_turn_rates_bounds_what_is_applied():
    policy = TD3.with_settings(turn=0.25, gradient=0.1)(Robot(LAYOUT, 2, seed=0))
    actions = np.array([policy(START + 100 * np.eye(11)[i]) for i in range(11)])
    assert (abs(actions) <= [0.6, np.pi / 8]).all()


def test_without_the_extra_one_sentence_says_what_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(Refusal, match=r"SAC needs stable-baselines3: .* nmpcrl\[agents\]"):
        SAC(Robot(LAYOUT, 1, seed=0))


def test_an_agent_is_judged_with_the_setting_that_costs_least_and_not_before_it_is_known():
    tuning = [
        {"part": "tune", "arm": str(AGENTS["SAC"].with_settings(**setting)), "place": place,
         "initial": [100.0], "costs": [[100.0 + abs(i - 2)]]}
        for i, setting in enumerate(SETTINGS["SAC"]) for place in PARTS["tune"].places
    ]  # fmt: skip
    assert str(tuned(pd.DataFrame(tuning), "SAC")) == "SAC[gradient=0.5,width=128]"
    with pytest.raises(Refusal, match="the part 'tune' comes first"):
        tuned(pd.DataFrame(tuning[1:]), "SAC")


def test_settings_are_the_published_tuning_s_and_one_agent_for_all_meets_new_layouts():
    table = SAC_AND_TD3.table()
    for part in PARTS:
        assert {*PARTS[part].settings(table)} == {*table[table.part == part].arm}
    assert {*agents.trained_in(agents.EVERY)} == {*TUNE}
    assert {*agents.judged_in(agents.EVERY)} == {*TUNE, *JUDGE}
    assert {*agents.judged_in("J001")} == {*agents.trained_in("J001")} == {"J001"}
