"""Figures 3 and 4: titles follow from the records, and every run has its line."""

from dataclasses import asdict

import numpy as np
import pytest
from matplotlib.figure import Figure

from nmpcrl.study import Experiment, Study, main_study, paper
from nmpcrl.study.figures import results
from nmpcrl.study.records import Records

STEPS = 5


def study(change=lambda experiment, states, actions: None, seeds=(0, 1)) -> Study:
    """Runs that drive straight to the target; `change` spoils some of them in place."""
    runs = {}
    for experiment in main_study(episodes=2, seeds=seeds):
        states = np.linspace(paper.START, paper.TARGET, STEPS)
        actions = np.zeros((STEPS, 2))
        change(experiment, states, actions)
        evaluations = {"states": states[None], "actions": actions[None]}
        runs[experiment] = Records(asdict(experiment), {}, evaluations, {})
    return Study(runs)


def title(figure: Figure) -> str:
    return figure.get_suptitle()


def spoil(experiment: Experiment, states: np.ndarray, actions: np.ndarray) -> None:
    """The first run of GES fails half-way."""
    if experiment.learner == "GES" and experiment.seed == 0:
        states[2:], actions[2:] = np.nan, np.nan


def aside(experiment: Experiment, states: np.ndarray, actions: np.ndarray) -> None:
    """RDES drives half a metre beside GES, too fast, and does not arrive."""
    if experiment.learner == "RDES":
        states[:, 1] += 0.5
        actions[0, 0] = 1.0


@pytest.mark.parametrize("draw", [results.controls, results.paths, results.states])
@pytest.mark.parametrize("seeds", [(0,), (0, 1)])
def test_there_is_a_line_for_every_run_of_the_learners_shown(draw, seeds):
    figure = draw(study(seeds=seeds))
    for axis in figure.axes:
        long = [line for line in axis.get_lines() if len(line.get_xdata()) == STEPS]
        assert len(long) == 3 * len(seeds)
        assert axis.get_ylabel() or axis is not figure.axes[0]


def test_the_titles_of_policies_that_agree():
    runs = study()
    assert title(results.controls(runs)) == "All inputs keep within their bounds"
    assert title(results.paths(runs)).endswith("up to 0.00 m apart")
    assert title(results.states(runs)) == "The learned policies end within 1 cm of the target"


def test_the_titles_follow_when_a_policy_goes_another_way():
    runs = study(aside)
    assert title(results.controls(runs)) == "4 inputs leave their bounds"
    assert title(results.paths(runs)).endswith("up to 0.50 m apart")
    assert title(results.states(runs)) == "The learned policies end within 50 cm of the target"


def test_a_rollout_that_failed_is_told_and_drawn_as_far_as_it_got():
    runs = study(spoil)
    assert title(results.paths(runs)) == title(results.states(runs)) == results.CUT_SHORT
    assert title(results.controls(runs)) == "All inputs keep within their bounds"


def test_axes_have_units():
    figure = results.states(study())
    labels = {axis.get_ylabel() for axis in figure.axes} | {a.get_xlabel() for a in figure.axes}
    assert {"x [m]", "y [m]", "heading [rad]", "time [s]"} <= labels
