"""The trap and the cliffs: the grey is where the robot stands."""

from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.analysis.trap import Stand
from nmpcrl.report.figures.runs import trap as figures
from nmpcrl.study import paper

WAY = np.array([[-2.5, 1.5, 0.0], [2.0, 2.0, 0.0]])
OPEN = Stand(0, 0.001, np.nan, WAY, 4000.0, True, 0.0, 0.1, 0.1, 0.0)
COSTS = np.array([4000.0, 4000.0, 7000.0])


def course(value=900.0):
    """Open, then closed from episode 4 to episode 12, then open again."""
    closed = [
        replace(OPEN, episode=k, theta_c=k / 10, delta=20.0 - k, cost=6000.0 + k, arrived=False,
                stage_cost=30.0, value=value)
        for k in (4, 8, 12)
    ]  # fmt: skip
    return [OPEN, *closed, replace(OPEN, episode=16, delta=3.0)]


def test_the_grey_is_where_the_robot_stands_and_nothing_is_drawn_where_it_arrived():
    figure = figures.trap(paper.task("E"), course(), (0, 1, 3), "It stands")
    _, *curves = figure.axes
    for axes in curves:
        (grey,) = axes.patches
        assert (grey.get_x(), grey.get_x() + grey.get_width()) == (4, 12)
    forever, value = (line.get_ydata() for line in curves[0].get_lines())
    assert np.isnan(forever[[0, -1]]).all()
    assert forever[1] == pytest.approx(30 / (1 - paper.GAMMA))
    assert value[1:4].tolist() == [900.0] * 3


def test_a_run_in_which_no_gap_closes_has_no_grey():
    stands = [OPEN, *[replace(OPEN, episode=4)] * 2]
    figure = figures.trap(paper.task("E"), stands, (0, 1, 2), "It arrives")
    assert not [patch for axes in figure.axes[1:] for patch in axes.patches]


def test_every_layout_has_its_two_lines_and_its_best_theta_c():
    grid = np.array([0.0, 0.2, 0.4])
    costs, best = {"A": (COSTS, 2 * COSTS), "E": (COSTS, COSTS)}, {"A": 0.3, "E": 0.1}
    figure = figures.cliffs(grid, costs, best, "It jumps")
    for axes, where in zip(figure.axes, best.values(), strict=True):
        _, along, border = (line.get_xydata() for line in axes.get_lines())
        assert along[:, 1].tolist() == [4.0, 4.0, 7.0]
        assert border[0, 0] == where
    assert figure.axes[0].get_lines()[0].get_ydata()[2] == 14.0


def test_layouts_are_read_in_order_and_each_column_has_its_ticks():
    costs, best = dict.fromkeys("ABCDEF", (COSTS, COSTS)), dict.fromkeys("ABCDEF", 0.3)
    figure = figures.cliffs(np.array([0.0, 0.2, 0.4]), costs, best, "It jumps")
    figure.draw_without_rendering()
    at = [axes.get_subplotspec() for axes in figure.axes]
    assert [(one.rowspan.start, one.colspan.start) for one in at] == [
        (i // 2, i % 2) for i in range(6)
    ]
    shown = [any(one.get_visible() and one.get_text() for one in axes.get_xticklabels())
             for axes in figure.axes]  # fmt: skip
    assert shown[-2:] == [True, True]
