"""What each part of exact TDC does: the title names the one that moves the end most."""

from dataclasses import asdict

import numpy as np

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.report.figures.learners import tdc
from nmpcrl.study import Experiment


def run(cost: float) -> RunSummary:
    """A run of TDC with so much of the first cost in the end."""
    experiment = Experiment("TDC", episodes=40)
    evaluations = {"episode": np.linspace(0, 40, 4), "cost": 100 * np.array([1, *[cost] * 3])}
    nothing, episodes = np.zeros((4, 3)), {"w": np.full((40, 9), 0.01)}
    about = {"stopped": "finished"}
    return RunSummary(asdict(experiment), episodes, evaluations, nothing, nothing[:, :2], about)


def test_the_part_that_moves_the_end_of_tdc_most_is_in_the_title():
    ends = {"TDC": 0.96, "without h": 0.92, "not projected": 0.97, "slow w": 0.95, "GES": 0.5}
    figure = tdc.parts_of_tdc({name: run(cost) for name, cost in ends.items()})
    assert "Leaving out h" in figure.finding
    assert "-4.0%" in figure.finding
    for axes in figure.axes:
        assert len(axes.get_lines()) == len(ends) == len(tdc.PARTS)
