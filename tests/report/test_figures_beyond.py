"""The figures of chapter 7: titles follow from the runs, and every run has its mark."""

from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from nmpcrl.analysis.policy_search import Found
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.report.figures import beyond
from nmpcrl.report.figures.style import LOOKS
from nmpcrl.study import Experiment, paper

EPISODES = 40
THERE = np.linspace(paper.START, paper.TARGET, 30)  # a drive that arrives ...
HALFWAY = THERE[:15].repeat(2, axis=0)  # ... and one that does not


def run(
    experiment: Experiment, *, size: float = 1.0, cost: float = 1.0, **facts: str
) -> RunSummary:
    """A run with alpha ||phi||^2 up to `size`, and so much of the first cost in the end."""
    count = experiment.episodes
    episodes = {
        "alpha_phi2": np.linspace(0.1, size, count),
        "w": np.full((count, 9), 0.01),
    }
    evaluations = {"episode": np.linspace(0, count, 4), "cost": 100 * np.array([1, *[cost] * 3])}
    nothing = np.zeros((4, 3))
    about = {"stopped": "finished"} | facts
    return RunSummary(asdict(experiment), episodes, evaluations, nothing, nothing[:, :2], about)


def title(figure: Figure) -> str:
    return figure.get_suptitle()


TDC = Experiment("TDC", episodes=EPISODES)


def test_a_w_that_is_lost_is_told_with_its_episode():
    fast, slow = (replace(TDC, beta_tdc=beta) for beta in (2e-7, 1e-7))
    lost = run(fast, size=2.0, stopped="diverged: it went")  # beta ||phi||^2 is twice that
    figure = beyond.step_of_w({2e-7: lost, 1e-7: run(slow, size=1.9)})
    assert title(figure).endswith("it passes 2 in episode 20 and w is lost")
    (axes,) = figure.axes
    drawn = [
        line.get_ydata().max() for line in axes.get_lines() if len(line.get_xdata()) == EPISODES
    ]
    assert drawn == pytest.approx([4.0, 1.9])


def test_a_w_that_keeps_is_told_too():
    assert title(beyond.step_of_w({1e-7: run(TDC)})) == "It stays below 2"


def test_the_part_that_moves_the_end_of_tdc_most_is_in_the_title():
    ends = {"TDC": 0.96, "without h": 0.92, "not projected": 0.97, "slow w": 0.95, "GES": 0.5}
    figure = beyond.parts_of_tdc({name: run(TDC, cost=cost) for name, cost in ends.items()})
    assert title(figure).startswith("Without h, TDC ends 4.0% of the first cost lower")
    assert set(ends) == set(beyond.PARTS)
    for axes in figure.axes:
        assert len(axes.get_lines()) == len(ends)


def test_the_lines_of_the_parts_can_be_told_apart_in_grey():
    styles = [str(look["linestyle"]) for look in beyond.PARTS.values()]
    assert len(set(styles)) == len(styles)


RUNS = pd.DataFrame(
    [
        {"layout": layout, "learner": learner, "decay": decay}
        for layout in ("A", "D")
        for learner in ("ES", "GES", "frozen")
        for decay in ("step", "episode")
        for _ in range(5)
    ]
)


def strips(values: pd.Series) -> Figure:
    seen = {"seen": (-0.1, 0.2), "label": "gain", "finding": "so it is", "mark": "all"}
    return beyond.strips(RUNS, values, ("ES", "GES"), **seen)


def marks(figure: Figure, learner: str) -> np.ndarray:
    """Heights of the marks of a learner."""
    lines = [line for axes in figure.axes for line in axes.get_lines()]
    mine = [line for line in lines if line.get_marker() == LOOKS[learner].marker]
    return np.concatenate([line.get_ydata() for line in mine])


def test_every_run_of_the_learners_shown_has_its_mark():
    figure = strips(pd.Series(np.linspace(0, 0.1, len(RUNS))))
    assert [axes.get_title("left") for axes in figure.axes] == ["A", "D"]
    assert title(figure) == "so it is"
    for learner in ("ES", "GES"):
        assert len(marks(figure, learner)) == (RUNS.learner == learner).sum()


def test_what_is_not_known_has_no_mark_and_what_is_beyond_lies_at_the_edge():
    values = pd.Series(0.0, RUNS.index)
    es, ges = (RUNS.index[RUNS.learner == name] for name in ("ES", "GES"))
    values[es[:3]], values[ges[:2]] = np.nan, [-np.inf, 0.7]
    figure = strips(values)
    assert len(marks(figure, "ES")) == len(es) - 3
    assert {marks(figure, "GES").min(), marks(figure, "GES").max()} == {-0.1, 0.2}


def test_a_learner_that_was_not_run_leaves_its_place_empty():
    kept = RUNS[RUNS.learner != "GES"].reset_index(drop=True)
    values = pd.Series(0.1, kept.index)
    seen = {"seen": (0, 1), "label": "gain", "finding": "", "mark": ""}
    figure = beyond.strips(kept, values, ("ES", "GES"), **seen)
    assert [tick.get_text() for tick in figure.axes[0].get_xticklabels()] == ["ES", "GES"]


def test_the_searches_are_named_without_overlap_and_summed_up():
    found = {
        name: Found(paper.THETA_INIT, 100, (1, 50), (100.0, end))
        for name, end in (("A", 90.0), ("B", 95.0), ("C", 95.1))
    }
    figure = beyond.searches(found)
    assert title(figure) == "The search takes 5% to 10% off the cost"
    heights = {text.get_text().strip(): text.xy[1] for text in figure.axes[0].texts}
    assert set(heights) == set(found)
    gaps = np.diff(sorted(heights.values()))
    assert gaps.min() >= 0.005


def test_the_roads_count_who_arrives_and_cross_out_who_does_not():
    ways = dict.fromkeys(beyond.ROADS, THERE)
    failed = np.where(np.arange(30)[:, None] < 10, THERE, np.nan)
    drives = {"A": ways, "B": ways | {"learned": HALFWAY}, "C": ways | {"by hand": failed}}
    figure = beyond.roads(drives)
    assert title(figure).startswith("Arrived, of 3 layouts: 2 after learning, 2 with")
    assert title(figure).endswith("3 at best")
    crosses = [sum(line.get_marker() == "X" for line in axes.get_lines()) for axes in figure.axes]
    assert crosses == [0, 1, 1]
