"""The least value on a box: as a fine grid finds it, on networks and where it is known."""

import numpy as np
import pytest

from nmpcrl.learning import QNetwork
from nmpcrl.learning.bootstrap import minimiser

LOWER, UPPER = np.array([0.0, -1.0]), np.array([0.6, 1.0])  # of the robot's inputs
FINE = np.stack(np.meshgrid(*np.linspace(LOWER, UPPER, 201).T), -1).reshape(-1, 2)


@pytest.mark.parametrize("least", [[0.13, 0.42], [0.0, -1.0], [0.6, 0.0], [0.301, -0.77], [0.3]])
def test_the_least_value_of_a_bowl_is_found_without_leaving_the_box(least):
    lower, upper, asked = LOWER[: len(least)], UPPER[: len(least)], []

    def bowl(points):
        asked.append(points)
        return ((points - least) ** 2).sum(axis=1)

    np.testing.assert_allclose(minimiser(bowl, lower, upper), least, atol=0.01)
    asked = np.vstack(asked)
    assert ((lower <= asked) & (asked <= upper)).all()


@pytest.mark.slow
def test_the_best_action_of_a_network_is_that_of_a_fine_grid():
    """Networks with weights up to three times as large as at the start, in states of the whole box.

    What it misses is a share of how far the values lie apart.
    """
    missed = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        network = QNetwork(5, rng)
        network.weights[:] *= rng.uniform(0.5, 3)
        state = rng.uniform([-3, -3, -np.pi], [9, 9, np.pi])

        def values(actions, network=network, state=state):
            return network.predict(np.hstack([np.tile(state, (len(actions), 1)), actions]))

        fine, best = values(FINE), values(minimiser(values, LOWER, UPPER)[None])[0]
        missed.append((best - fine.min()) / np.ptp(fine))
    assert np.mean(np.array(missed) < 1e-2) >= 0.97
    assert max(missed) < 0.05
