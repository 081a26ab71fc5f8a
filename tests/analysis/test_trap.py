"""The trap: what a run that stands before a closed gap shows, and one that arrives does not."""

import numpy as np
import pytest

from nmpcrl.analysis.summary import summarise
from nmpcrl.analysis.trap import ending
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.run import run


def frozen(theta_c):
    theta = (*paper.THETA_INIT[:-1], theta_c)
    return summarise(run(Experiment("frozen", layout="E", theta=theta, episodes=2)))


@pytest.fixture(scope="module")
def standing():
    return frozen(0.2)


def test_before_a_closed_gap_the_robot_stands_and_the_plan_is_worth_less_than_standing(standing):
    found = ending(standing)
    assert found.moved < 0.05
    assert 0 < found.worth < 1
    assert found.phi_c > 0


def test_so_the_td_error_there_is_above_0(standing):
    experiment, state = standing.name, standing.states[-1]
    cost = experiment.task.stage_cost(state, standing.actions[-1])
    value = ending(standing).worth * cost / (1 - paper.GAMMA)
    assert cost + paper.GAMMA * value - value > 0


def test_of_a_run_that_arrives_nothing_is_said_but_of_its_td_error():
    found = ending(frozen(paper.THETA_INIT[-1]))
    assert np.isnan([found.moved, found.worth, found.phi_c]).all()
