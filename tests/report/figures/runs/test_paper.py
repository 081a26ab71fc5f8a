"""Figs. 1 to 4 of the paper, drawn from small runs and read back."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from nmpcrl.report.figures.runs import paper as draw
from nmpcrl.study import Records, Runs, paper
from nmpcrl.study.design import paper_runs
from nmpcrl.study.records import Stopped

EPISODES, STEPS = 4, 5
FIGURES = (draw.figure_1, draw.figure_2, draw.figure_3, draw.figure_4)


def records(factor: float, beside: float = 0.0, stopped: str = Stopped.FINISHED) -> Records:
    """A run whose episodes cost `factor` more and more, and that ends beside the target."""
    episode = np.repeat(np.arange(EPISODES), STEPS)
    steps = {"episode": episode, "cost": factor**episode, "status": np.zeros_like(episode)}
    states = np.linspace(paper.START, np.array(paper.TARGET) + [0, beside, 0], STEPS)
    evaluations = {
        "episode": np.array([0, 2, 4]),
        "cost": np.array([100.0, 99.0, 98.0]),
        "states": np.array([states]),
        "actions": np.full((1, STEPS, 2), 0.5 + beside),
    }
    fields = {"episodes": EPISODES, "steps": STEPS, "theta": list(paper.THETA_INIT)}
    return Records(fields, steps, evaluations, {"stopped": stopped})


def study(*, des: float = 1.0, beside: float = 0.0, stopped: str = Stopped.FINISHED) -> Runs:
    """All runs of a chapter, two seeds; `beside` and `stopped` are about RDES."""
    of = {"DES": records(des), "RDES": records(1.0, beside, stopped)}
    return Runs({e: of.get(e.learner, records(1.0)) for e in paper_runs(EPISODES)})


@pytest.mark.parametrize("figure", FIGURES)
def test_every_figure_has_a_finding_and_its_axes_are_named(figure, assert_readable):
    assert_readable(figure(study()))


def test_figure_1_counts_the_runs_that_diverged_and_draws_their_raw_costs(texts):
    figure = draw.figure_1(study(des=3.0))
    assert texts(figure).startswith("Divergence: DES in 4 of 4 runs, RDES in 0 of 4 runs")
    costs = [line.get_ydata() for line in figure.axes[0].lines if line.get_label() == "DES"]
    assert costs[0] == pytest.approx(STEPS * 3.0 ** np.arange(EPISODES))


def test_figure_2_counts_the_runs_that_were_unstable(texts):
    assert texts(draw.figure_2(study())).startswith("Instability: ES in 0 of 4 runs, GES in 0")


@pytest.mark.parametrize(
    ("figure", "looks"),
    [
        (draw.figure_1, {"DES": ("#000000", "--"), "RDES": (draw.BLUE, "-")}),
        (draw.figure_2, {"ES": (draw.BLUE, "-"), "GES": (draw.RED, "-")}),
    ],
)
def test_the_colours_are_those_that_the_paper_names(figure, looks):
    (legend,) = figure(study()).legends
    lines = zip(legend.get_texts(), legend.get_lines(), strict=True)
    shown = {
        text.get_text(): (to_hex(line.get_color()), line.get_linestyle()) for text, line in lines
    }
    assert shown == {name: (color.lower(), line) for name, (color, line) in looks.items()}


@pytest.mark.parametrize(
    ("beside", "says"), [(0.0, "all inputs keep within"), (0.2, "20 inputs leave")]
)
def test_figure_3_says_whether_inputs_leave_their_bounds(beside, says, texts):
    assert f"In 8 rollouts of RDES and GES, {says}" in texts(draw.figure_3(study(beside=beside)))


def test_figure_4_says_how_far_the_two_policies_come_to_be_apart(texts):
    assert "up to 0.30 m apart" in texts(draw.figure_4(study(beside=0.3)))
    assert draw.policy_distances(study(beside=0.3)) == pytest.approx([0.3] * 4)


def test_a_run_that_was_stopped_left_no_policy(texts):
    gone = study(stopped=Stopped.DIVERGED)
    assert "In 4 rollouts" in texts(draw.figure_3(gone))
    assert "No pair of runs" in texts(draw.figure_4(gone))
