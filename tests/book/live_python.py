"""What Python finds for what a live figure was asked."""

from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.control import Obstacle
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import paper


def in_python(given: dict):
    """The plan and the closed loop of what a page was asked."""
    task = replace(
        paper.task("A"),
        start=np.array(given["start"]),
        obstacles=tuple(Obstacle(x, y) for x, y, _ in given["discs"]),
    )
    nmpc = paper.controller(task, horizon=given["horizon"])
    theta = np.array(given["theta"])
    return nmpc.solve(task.start, theta), evaluate(nmpc, theta, paper.STEPS)


def assert_equal_to_python(shown: dict) -> None:
    found = shown["found"]
    plan, rollout = in_python(shown["given"])
    assert not found["failed"]
    assert found["plan"]["value"] == pytest.approx(plan.value, rel=1e-9)
    assert found["cost"] == pytest.approx(rollout.cost, rel=1e-6)
    np.testing.assert_allclose(found["plan"]["action"], plan.action, atol=1e-6)
    np.testing.assert_allclose(found["plan"]["states"], plan.states, atol=1e-6)
    assert found["plan"]["slack"] == pytest.approx(plan.slacks.max(), abs=1e-6)
    np.testing.assert_allclose(found["states"], rollout.states, atol=1e-4)
    slack = (
        paper.SLACK_WEIGHT * paper.GAMMA ** np.arange(len(plan.slacks)) @ plan.slacks.sum(axis=1)
    )
    assert found["parts"]["slacks"] == pytest.approx(slack, abs=1e-6 * plan.value)
    assert sum(found["parts"].values()) == pytest.approx(plan.value)
