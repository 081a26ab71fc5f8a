"""Two networks on the same examples: the comparison of chapter 3."""

import numpy as np
import pytest

from nmpcrl.analysis.imitation import HELD_OUT, imitate
from nmpcrl.study.records import Records


def made_up(value, theta, *, episodes=5, steps=60):
    """Records of a run that never was, with the columns that `imitate` reads."""
    rng = np.random.default_rng(0)
    episode = np.repeat(np.arange(episodes), steps)
    state = rng.uniform(-1, 1, (episodes * steps, 3))
    action = rng.normal(size=(episodes * steps, 2))
    before = np.vstack([theta[:1], theta[:-1]])
    columns = {"episode": episode, "state": state, "action": action, "theta": theta}
    return Records({"theta": theta[0]}, columns | {"value": value(state, before)}, {}, {})


MOVING = np.random.default_rng(1).uniform(0, 2, (300, 9))  # another theta at every step


def test_a_network_with_theta_follows_a_value_that_depends_on_it_in_episodes_held_out():
    records = made_up(lambda _, theta: 10 * theta[:, 0], MOVING)
    assert imitate(records, fits=500).ratio < 0.5
    imitation = imitate(made_up(lambda state, _: 10 * state[:, 0], MOVING), fits=1000)
    assert imitation.error("without_theta") < 0.3 * imitation.value.std()
    squares = (imitation.without_theta - imitation.value) ** 2
    assert imitation.error("without_theta") == pytest.approx(np.sqrt(squares.mean()))
    assert imitation.error("with_theta") < 0.5 * imitation.value.std()

    def value(state, _):
        return state[:, 0]

    records = made_up(value, MOVING)
    assert {*imitate(records, fits=1).episode} == {HELD_OUT - 1}
    few = made_up(value, MOVING[:240], episodes=3, steps=80)
    assert {*imitate(few, fits=1).episode} == {2}
    records.steps["value"][-10:] = np.nan
    first, again = (imitate(records, fits=20) for _ in range(2))
    assert first.value.size == 50
    np.testing.assert_array_equal(first.with_theta, again.with_theta)
    held_out = records.steps["episode"] == HELD_OUT - 1  # and no network has seen its values
    records.steps["value"] = records.steps["value"] + 1e3 * held_out
    np.testing.assert_array_equal(imitate(records, fits=20).with_theta, first.with_theta)
