"""What is counted where obstacles move, against cases that can be counted by hand."""

import numpy as np
import pytest

from nmpcrl.analysis.encounters import Contacts, count, crowding, judged
from nmpcrl.study import paper
from nmpcrl.study.faults import FAULTS
from nmpcrl.study.moving import Straight, World, controller, still

THETA = np.array(paper.THETA_INIT)


def test_states_inside_and_crowding_are_counted_by_hand_and_true_states_are_judged():
    passing = [Straight((-2.0, 0.0), (5.0, 0.0))]  # 1 m a step: -2, -1, 0, 1, 2, 3
    states = np.zeros((6, 3))
    assert count(states, passing) == Contacts(inside=3, collisions=1)
    assert count(states, [Straight((0.0, 0.5))]) == Contacts(6, 1)  # entered at the start
    assert count(states, [*passing, Straight((-2.0, 0.0), (5.0, 0.0))]) == Contacts(3, 2)
    assert count(states, still([(3.0, 0.0)])) == Contacts(0, 0)
    world = World(still(paper.LAYOUTS["A"]), fault=FAULTS["noise"])
    one, same, other = (judged(controller(), THETA, world, seed) for seed in (1, 1, 2))
    assert one.cost == same.cost != other.cost
    assert one.arrived
    assert len(one.states) == paper.STEPS + 1
    assert np.abs(np.diff(one.states[:, 0])).max() <= 0.12 + 1e-9  # no jump by a measurement
    one = crowding(still([(3.0, 1.75)]))
    share = np.pi * 1.25**2 / (11.0 * (0.5 + 2 * 2.5))
    assert one == pytest.approx(share, rel=0.1)
    assert crowding(still([(99.0, 99.0)])) == 0
    assert crowding(still(paper.LAYOUTS["A"])) > one
    early, late = ([Straight((x, 1.75), (v, 0.0))] for x, v in ((-2.5, 0.42), (-2.5, 5.0)))
    assert crowding(early) > 3 * crowding(late)
