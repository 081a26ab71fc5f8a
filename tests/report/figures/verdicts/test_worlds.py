"""Figures of worlds that move, change, or are not the model: titles follow from the numbers."""

import numpy as np
import pandas as pd

from nmpcrl.report.figures.verdicts import worlds as figures


def test_of_a_wrong_model_each_fault_has_its_policies_and_the_title_their_medians():
    layouts = pd.Series([0.02, 0.03, 0.04])
    saved = pd.DataFrame({"oracle": layouts - 0.035, "ES": layouts, "ES+model": layouts - 0.01,
                          "grid": layouts + 0.03})  # fmt: skip
    figure = figures.models(pd.concat({"speed": saved, "lag": saved.assign(oracle=np.nan)}))
    assert (
        figure.finding == "The true model changes the cost by +0.5%, a grid over theta_c by −6.0%"
    )
    (axes,) = figure.axes
    counts = {line.get_label(): len(line.get_xdata()) for line in axes.get_lines()[:4]}
    assert counts["true model"] == 1
    assert counts["ES"] == 2


def test_after_a_change_each_arm_has_a_line_and_the_title_where_two_end():
    ends = dict(zip(figures.ARMS, (0.9, 0.92, 1.2, 1.3), strict=True))
    shares = {arm: [np.linspace(1, end, 60)] * 4 for arm, end in ends.items()}
    figure = figures.shifts(shares, 150)
    assert "costs 90% of replanning" in figure.finding
    assert "120%" in figure.finding
    (axes,) = figure.axes
    assert axes.get_lines()[2].get_xdata()[[0, -1]].tolist() == [5, 300]
    assert len(axes.get_lines()) == len(ends) + 2  # and the dotted ones
