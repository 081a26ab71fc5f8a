"""One number of every run, layout by layout: every run of the learners shown has its mark."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nmpcrl.report.figures.runs import comparison
from nmpcrl.report.figures.style import LOOKS

RUNS = pd.DataFrame(
    [
        {"layout": layout, "learner": learner, "decay": decay}
        for layout in ("A", "D")
        for learner in ("ES", "GES", "frozen")
        for decay in ("step", "episode")
        for _ in range(5)
    ]
)


def drawn(values: pd.Series) -> Figure:
    seen = {"seen": (-0.1, 0.2), "label": "gain", "finding": "so it is", "mark": "all"}
    return comparison.by_layout(RUNS, values, ("ES", "GES"), **seen)


def marks(figure: Figure, learner: str) -> np.ndarray:
    """Heights of the marks of a learner."""
    lines = [line for axes in figure.axes for line in axes.get_lines()]
    mine = [line for line in lines if line.get_marker() == LOOKS[learner].marker]
    return np.concatenate([line.get_ydata() for line in mine])


def test_every_run_of_the_learners_shown_has_its_mark():
    figure = drawn(pd.Series(np.linspace(0, 0.1, len(RUNS))))
    assert [axes.get_title("left") for axes in figure.axes] == ["A", "D"]
    assert figure.get_suptitle() == "so it is"
    for learner in ("ES", "GES"):
        assert len(marks(figure, learner)) == (RUNS.learner == learner).sum()


def test_what_is_not_known_has_no_mark_and_what_is_beyond_lies_at_the_edge():
    values = pd.Series(0.0, RUNS.index)
    es, ges = (RUNS.index[RUNS.learner == name] for name in ("ES", "GES"))
    values[es[:3]], values[ges[:2]] = np.nan, [-np.inf, 0.7]
    figure = drawn(values)
    assert len(marks(figure, "ES")) == len(es) - 3
    assert {marks(figure, "GES").min(), marks(figure, "GES").max()} == {-0.1, 0.2}
