"""The figures of exact TDC: titles follow from the runs, and its parts are distinct."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.report.figures.learners import tdc
from nmpcrl.study import Experiment

EPISODES = 40


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


def test_a_w_that_is_lost_is_named_with_its_episode():
    fast, slow = (replace(TDC, beta_tdc=beta) for beta in (2e-7, 1e-7))
    lost = run(fast, size=2.0, stopped="diverged: it went")  # beta ||phi||^2 is twice that
    figure = tdc.step_of_w({2e-7: lost, 1e-7: run(slow, size=1.9)})
    assert title(figure).endswith(
        r"$\beta\,\|\phi\|^2$ passes 2 in episode 20, and the run is stopped"
    )
    (axes,) = figure.axes
    drawn = [
        line.get_ydata().max() for line in axes.get_lines() if len(line.get_xdata()) == EPISODES
    ]
    assert drawn == pytest.approx([4.0, 1.9])


def test_the_part_that_moves_the_end_of_tdc_most_is_in_the_title():
    ends = {"TDC": 0.96, "without h": 0.92, "not projected": 0.97, "slow w": 0.95, "GES": 0.5}
    figure = tdc.parts_of_tdc({name: run(TDC, cost=cost) for name, cost in ends.items()})
    assert title(figure).startswith("Leaving out h lowers the final cost by 4.0% of the first")
    assert set(ends) == set(tdc.PARTS)
    for axes in figure.axes:
        assert len(axes.get_lines()) == len(ends)
