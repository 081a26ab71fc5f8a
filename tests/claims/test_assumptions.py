"""The audit reports what is run, and an assumption can hold."""

from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.analysis.gradient_td import Curvature
from nmpcrl.claims.assumptions import LINEAR, SMOOTH, THEOREMS, audit
from nmpcrl.study import Experiment, Records, Runs, paper

KINK = (0.5, 2.2 - 1.25 * np.sqrt(1 + paper.THETA_INIT[-1]), 0.0)  # Xi + theta_c = 0 in layout A


def study(experiment: Experiment, state=(-2.0, -2.0, 0.0)) -> Runs:
    """A run of GES that stays in one state and whose theta does not move."""
    steps = {
        "state": np.tile(state, (4, 1)),
        "theta": np.tile(paper.THETA_INIT, (4, 1)),
        "delta": np.array([1.0, 2.0, 3.0, 4.0]),
    }
    return Runs({experiment: Records({"theta": paper.THETA_INIT}, steps, {}, {})})


def holding(runs: Runs, dropped: float = 0.1) -> dict[str, bool]:
    """Which assumptions hold, by their first words."""
    size = np.array([1.0])
    return {a.theorem: a.holds for a in audit(runs, Curvature(size, size, dropped * size))}


PAPER = Experiment(learner="GES")


def test_the_assumptions_that_no_setting_can_change_do_not_hold():
    held = holding(study(PAPER))
    assert not held["a finite MDP"]
    assert not held["the value is linear in theta"]
    assert not held["the policy that acts stays the same"]
    assert not held["theta is projected onto a compact set"]
    assert not held["step sizes that decay, their squares summable"]


@pytest.mark.parametrize(("beta", "faster"), [(1e-8, False), (1e-7, False), (2e-7, True)])
def test_w_is_faster_than_theta_only_if_its_step_size_is_larger(beta, faster):
    held = holding(study(replace(PAPER, beta=beta)))
    assert held["w moves faster than theta, alpha / beta to 0"] == faster


@pytest.mark.parametrize(("state", "smooth"), [((-2.0, -2.0, 0.0), True), (KINK, False)])
def test_a_step_on_an_obstacle_s_boundary_breaks_differentiability(state, smooth):
    held = holding(study(PAPER, state))
    assert held["the value is three times differentiable in theta"] == smooth


@pytest.mark.parametrize(("dropped", "exact"), [(0.0, True), (1e-3, False)])
def test_the_update_follows_the_gradient_only_if_nothing_is_dropped(dropped, exact):
    held = holding(study(PAPER), dropped)
    assert held["the update follows the gradient of the MSPBE, curvature included"] == exact


def test_the_measurements_are_told():
    size = np.array([2.0])
    told = " ".join(a.here for a in audit(study(PAPER), Curvature(size, size, size / 4)))
    assert "2.5e-01 in the median" in told
    assert "correlation of 1.00" in told


def test_each_theorem_is_asked_for_what_it_assumes_and_for_no_more():
    size = np.array([1.0])
    made = {a.theorem: a.by for a in audit(study(PAPER), Curvature(size, size, size))}
    assert made["the value is linear in theta"] == (LINEAR,)
    assert made["the value is three times differentiable in theta"] == (SMOOTH,)
    assert made["step sizes that decay, their squares summable"] == THEOREMS
    assert all(set(by) <= set(THEOREMS) and by for by in made.values())
