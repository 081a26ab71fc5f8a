"""The robot in the loop need not be the one of the plan."""

import numpy as np
import pytest

from nmpcrl.control import differential_drive
from nmpcrl.study import Experiment, run
from nmpcrl.study.plants import DRIFT, GRIP, PLANTS, plant_of
from nmpcrl.study.provenance import key

STATE, ACTION = np.array([1.0, 2.0, 0.0]), np.array([0.5, 0.0])


def test_a_slipping_robot_moves_less_far():
    moved = plant_of("slipping").step(STATE, ACTION) - STATE
    np.testing.assert_allclose(moved, [GRIP * 0.5 * 0.2, 0, 0], atol=1e-12)


def test_a_current_takes_a_drifting_robot_along():
    moved = plant_of("drifting").step(STATE, ACTION)
    other = differential_drive().step(STATE, ACTION)
    np.testing.assert_allclose(moved - other, [0, DRIFT * 0.2, 0], atol=1e-12)


def test_the_key_of_every_run_whose_plant_plans_stays():
    assert key(Experiment(plant="model")) == key(Experiment())
    keys = {key(Experiment(plant=plant)) for plant in PLANTS}
    assert len(keys) == len(PLANTS)


@pytest.mark.parametrize("plant", ["slipping", "drifting"])
def test_training_and_rollouts_have_the_plant_in_the_loop(plant):
    records = run(Experiment(plant=plant, episodes=1, steps=4))
    other = plant_of(plant)
    for table, rows in ((records.steps, 3), (records.evaluations, None)):
        states, actions = (
            table[name] if rows else table[name][0]
            for name in (("state", "action") if rows else ("states", "actions"))
        )
        for k in range(3):
            np.testing.assert_array_equal(states[k + 1], other.step(states[k], actions[k]))
