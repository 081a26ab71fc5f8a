"""Every episode of an entry's robot counts, however it is begun, and none beyond the budget."""

import numpy as np
import pytest

from nmpcrl.analysis.interaction import OverBudget, Robot
from nmpcrl.learning import Exploration, Weights, evaluate, expected_sarsa, train
from nmpcrl.study import paper

LAYOUT, THETA = paper.LAYOUTS["B"], np.array(paper.THETA_INIT)


def steps_of(robot, episodes, steps=3):
    noise = Exploration.draw(np.random.default_rng(0), (episodes, steps, 2))
    learner = expected_sarsa(robot.controller, paper.ALPHA)
    return robot.train(learner, Weights(THETA, np.zeros(9)), noise)


def test_what_is_trained_and_rolled_out_is_what_the_library_does():
    robot = Robot(LAYOUT, 5, 0)
    noise = Exploration.draw(np.random.default_rng(0), (2, 3, 2))
    learner = expected_sarsa(robot.controller, paper.ALPHA)
    known = list(train(learner, robot.controller, Weights(THETA, np.zeros(9)), noise))
    found = list(steps_of(robot, 2))
    np.testing.assert_array_equal(
        [one.weights.theta for one in found], [one.weights.theta for one in known]
    )
    assert robot.cost(THETA) == evaluate(robot.controller, THETA, paper.STEPS).cost
    assert (robot.begun, robot.left) == (3, 2)


def test_an_episode_beyond_the_budget_is_not_begun():
    robot = Robot(LAYOUT, 2, 0)
    training = steps_of(robot, 4)
    assert [next(training).episode for _ in range(6)] == [0, 0, 0, 1, 1, 1]
    with pytest.raises(OverBudget, match="episode 3 was begun with a budget of 2"):
        next(training)
    assert robot.left == 0
    for more in (lambda: robot.cost(THETA), lambda: robot.env().reset()):
        with pytest.raises(OverBudget):
            more()


def test_an_episode_that_is_left_early_counts_and_one_that_is_not_begun_does_not():
    robot = Robot(LAYOUT, 3, 0)
    training = steps_of(robot, 3)
    assert robot.begun == 0
    next(training)
    assert robot.begun == 1


def test_a_reset_of_the_environment_counts_and_its_layout_stays():
    robot = Robot(LAYOUT, 2, 0)
    env = robot.env()
    for _ in range(2):
        _, info = env.reset(options={"layout": "A"})
        assert info["layout"] == LAYOUT
    assert robot.left == 0


def test_the_same_seed_draws_the_same():
    drawn = [Robot(LAYOUT, 1, seed).rng.normal() for seed in (1, 1, 2)]
    assert drawn[0] == drawn[1] != drawn[2]
