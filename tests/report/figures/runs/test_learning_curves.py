"""Figures 1 to 4 over seeds: titles follow from the runs, and no run is lost."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from nmpcrl.report.figures.runs import learning_curves, rollouts
from nmpcrl.study import Experiment

SEEDS = 4
FAST = np.ones((5, 2))  # 1 m/s, and the robot's bound is 0.6


def title(figure: Figure) -> str:
    return figure.get_suptitle()


def thick(axis) -> list:
    """The medians."""
    return [line for line in axis.get_lines() if line.get_linewidth() == 1.6]


def des_fails(experiment: Experiment) -> dict:
    """DES costs twice as much in layout A, and was stopped half-way where noise is per episode."""
    if experiment.learner != "DES" or experiment.layout != "A":
        return {}
    return {"training": 2.0, "reached": 150 if experiment.decay == "episode" else None}


def standing(states: np.ndarray) -> np.ndarray:
    """The same rollout, but the robot stays at the second place."""
    stuck = states.copy()
    stuck[2:] = stuck[1]
    return stuck


# Curves


def test_costs_are_in_units_of_the_start_without_noise(made_up):
    run = next(iter(made_up(lambda e: {"end": 0.8, "training": 1.5}).summaries.values()))
    np.testing.assert_allclose(learning_curves.trained(run)[1], 1.5)
    np.testing.assert_allclose(learning_curves.judged(run)[1], [1.0, *[0.8] * 30])


def test_what_was_cut_short_or_never_reached_costs_infinitely_much(made_up):
    run = next(iter(made_up(lambda e: {"reached": 100}).summaries.values()))
    run.episodes["cost"][3] = np.nan
    episodes, cost = learning_curves.trained(run)
    assert episodes[np.isinf(cost)].tolist() == [4, *range(101, 301)]
    due, judged = learning_curves.judged(run)
    assert due.tolist() == list(range(0, 301, 10))
    assert due[np.isinf(judged)].tolist() == list(range(110, 301, 10))


def test_figures_1_and_2_count_what_the_claims_count(made_up):
    found = made_up(des_fails)
    assert title(learning_curves.figure_1(found, "A")) == (
        "Divergence in layout A: DES in 8 of 8, RDES in 0 of 8 runs"
    )
    assert "DES in 0 of 8" in title(learning_curves.figure_1(found, "D"))
    swinging = made_up(lambda e: {"swing": 0.1 * (e.learner == "ES")})
    assert title(learning_curves.figure_2(swinging, "A")) == (
        "Instability in layout A: ES in 8 of 8, GES in 0 of 8 runs"
    )


def test_nothing_leaves_its_panel_and_what_is_off_the_scale_is_in_a_strip(made_up):
    figure = learning_curves.figure_1(made_up(des_fails), "A")
    for axis in (figure.axes[1], figure.axes[3]):  # noise per episode: above and below
        start, middle, stop = learning_curves.STRIP
        assert axis.get_ylim()[1] == stop
        assert axis.texts[-1].get_text() == "> 4"
        (des, *others) = (line.get_ydata() for line in thick(axis))
        assert (des[-1], max(des)) == (middle, middle)
        assert max(map(max, others)) < learning_curves.CEILING < start


def test_the_band_holds_the_middle_half_of_the_seeds(made_up):
    found = made_up(lambda e: {"end": 0.6 + 0.1 * e.seed}, seeds=(0, 1, 2, 3, 4))
    figure = learning_curves.figure_2(found, "A")
    band = figure.axes[2].collections[1].get_paths()[0].vertices[:, 1]  # of ES, without noise
    assert band.min() == pytest.approx(0.7)
    assert band.max() == pytest.approx(1.0)
    assert thick(figure.axes[2])[0].get_ydata()[-1] == pytest.approx(0.8)


# Rollouts


def test_inputs_that_leave_their_bounds_are_counted(made_up):
    kept = title(rollouts.controls(made_up(), "A"))
    assert re.fullmatch(
        r"RDES and GES use up to \d+% of the speed and \d+% of the turn rate allowed", kept
    )
    found = made_up(lambda e: {"actions": FAST} if (e.learner, e.seed) == ("GES", 0) else {})
    assert "; 10 inputs leave their bounds" in title(rollouts.controls(found, "A"))


def test_endings_are_counted_and_those_that_were_stopped_are_not_drawn(made_up):
    states = made_up().summaries[Experiment("RDES")].states

    def unlike(experiment: Experiment) -> dict:
        if (experiment.learner, experiment.seed) == ("RDES", 0):
            return {"states": standing(states)}
        return {"reached": 50} if (experiment.learner, experiment.seed) == ("RDES", 1) else {}

    found = made_up(unlike)
    figure = rollouts.maps(found)
    assert title(figure) == "After 24 of 32 runs of RDES and GES the robot reaches the target"
    ends = [line for line in figure.axes[0].get_lines() if len(line.get_xdata()) == 5]
    assert len(ends) == 2 * (3 * SEEDS - 1)


# All of them
