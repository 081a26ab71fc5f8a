"""A policy, as users of other libraries call it."""

import pickle

import numpy as np
import pytest
from small_problems import pendulum

from nmpcrl.control import Nmpc, Policy
from nmpcrl.learning import evaluate

STATE, STEPS = np.array([0.6, -0.4]), 6
NMPC = Nmpc(pendulum(), solver="fatrop")
THETA = NMPC.problem.vector(rate=1.5)


def test_a_policy_acts_as_a_rollout_does_and_remembers_the_plan_before():
    policy = Policy(NMPC, THETA)
    for _ in range(2):
        policy.reset()
        loop = evaluate(NMPC, THETA, STEPS, plant=NMPC.problem.plant(), start=STATE)
        assert [policy(state).tolist() for state in loop.states] == loop.actions.tolist()


@pytest.mark.parametrize(
    "data", [{"wind": 0.1 * np.arange(9.0)}, lambda t: {"wind": 0.1 * np.arange(t, t + 7.0)}]
)
def test_each_way_of_calling_sees_the_data_of_its_time(data):
    """A forecast of 9 stages, of which 7 are seen at a time."""
    loop = evaluate(NMPC, THETA, 3, plant=NMPC.problem.plant(), start=STATE, data=data)
    policy, wanted, before = Policy(NMPC, THETA, data), loop.actions.tolist(), None
    assert [policy(state).tolist() for state in loop.states] == wanted
    policy.reset()
    assert [policy.make_step(state)[:, 0].tolist() for state in loop.states] == wanted
    for state, action in zip(loop.states, wanted, strict=True):
        found, before = policy.predict(state, before)
        assert found.tolist() == action
    assert policy.predict(STATE, before, np.array([True]))[0].tolist() == wanted[0]


def test_a_policy_is_saved_and_loaded_to_the_last_bit(tmp_path):
    policy = Policy(NMPC, THETA)
    wanted = policy(STATE)
    policy.save(tmp_path / "policy")
    loaded = Policy.load(tmp_path / "policy")
    assert loaded.solution is None
    assert loaded(STATE).tolist() == wanted.tolist()
    (tmp_path / "other").write_bytes(pickle.dumps({}))
    with pytest.raises(ValueError, match="holds a dict; it must hold a Policy"):
        Policy.load(tmp_path / "other")
