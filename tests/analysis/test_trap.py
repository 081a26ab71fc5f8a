"""The trap: what a run that stands before a closed gap shows, and one that arrives does not."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from nmpcrl.analysis.summary import summarise
from nmpcrl.analysis.trap import cliff, ending, raised_cost, stands, stretch
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.run import run


def frozen(theta_c):
    theta = (*paper.THETA_INIT[:-1], theta_c)
    return summarise(run(Experiment("frozen", layout="E", theta=theta, episodes=2)))


def test_before_a_closed_gap_the_robot_stands_and_its_td_error_is_above_0():
    standing = frozen(0.2)
    found = ending(standing)
    assert found["moved"] < 0.05
    assert 0 < found["worth"] < 1
    assert found["phi_c"] > 0
    cost = standing.name.task.stage_cost(standing.states[-1], standing.actions[-1])
    value = found["worth"] * cost / (1 - paper.GAMMA)
    assert cost + paper.GAMMA * value - value > 0
    delta = np.r_[np.full(20, 3.0), 9.0, np.full(20, 4.0), np.nan]
    arrived = replace(frozen(paper.THETA_INIT[-1]), episodes={"delta": delta})
    np.testing.assert_array_equal([*ending(arrived).values()], [np.nan, np.nan, 3, 4, np.nan])
    learned = replace(standing, episodes=standing.episodes | {"delta": np.array([7.0, 3.0])})
    first, last = stands(learned, (0, 2))  # which agree with the summary
    assert (first.episode, last.episode) == (0, 2)
    assert np.isnan(first.delta)
    assert last.delta == 3
    assert not last.arrived
    np.testing.assert_array_equal(last.states, standing.states)
    assert last.value / last.forever == pytest.approx(found["worth"])
    assert (last.moved, last.phi_c) == pytest.approx((found["moved"], found["phi_c"]))


def test_a_stretch_is_the_first_unbroken_stand_and_a_cliff_lies_between_points_of_a_grid():
    course = [(True, 0.0), (False, 1.2), (False, 0.01), (False, 0.01), (True, 0.0), (False, 0.01)]
    found = [SimpleNamespace(arrived=arrived, moved=moved) for arrived, moved in course]
    assert stretch(found, 0.05) == found[2:4]
    assert stretch(found[:2], 0.05) == []

    def cost(theta_c):
        return 100.0 + (60.0 if theta_c > 0.137 else theta_c)

    grid = np.linspace(0, 0.4, 5)
    found = cliff(cost, grid, np.array([cost(one) for one in grid]))
    assert found == pytest.approx(0.137, abs=1e-3)
    assert cost(found) < 101
    assert np.isnan(cliff(cost, grid[:2], np.array([100.0, 119.0])))
    theta = np.array([*paper.THETA_INIT[:-1], 0.15])
    assert raised_cost("E", theta, 0.0) == 0
    assert raised_cost("E", theta, 1 / 3) > 0.5
