"""Figures of worlds that move, change, or are not the model: titles follow from the numbers."""

import numpy as np
import pandas as pd

from nmpcrl.report.figures.verdicts import worlds as figures
from nmpcrl.studies.worlds import VIEWS

SCENARIOS = [f"M{i:02}" for i in range(1, 21)]
COSTS = {"init": 100.0, "ES": 98.0, "grid": 92.0, "CMA-ES": 90.0}
ARMS = [arm for arms in figures.ARMS.values() for arm in arms]
INSIDE = {"init": 15, "ES": 4, "grid": 1, "CMA-ES": 3}


def test_the_title_says_what_policies_save_and_keep_out_of_obstacles():
    arms = {f"{view} {how}": cost for view in VIEWS for how, cost in COSTS.items()}
    costs = pd.DataFrame({arm: np.full(20, cost) for arm, cost in arms.items()}, index=SCENARIOS)
    met = pd.DataFrame(
        {arm: np.arange(20) < INSIDE[arm.split()[1]] for arm in arms}, index=SCENARIOS, dtype=float
    )
    figure = figures.policies(costs, met)
    assert "saves 8% and ES 2%" in figure.finding
    assert "inside in 1 and 4 scenarios instead of 15" in figure.finding
    left, right = figure.axes
    assert [len(axes.get_lines()) for axes in (left, right)] == [len(VIEWS) + 1, len(VIEWS)]
    by_view = right.get_lines()[1].get_xdata()
    assert [*by_view] == [INSIDE[how] / 20 for how in figures.POLICIES]


def test_survival_is_counted_in_thirds_of_the_scenarios_by_how_crowded_they_are():
    crowding = pd.Series(np.linspace(0.1, 0.4, 20), index=SCENARIOS)
    met = pd.DataFrame(
        {f"{view} {how}": np.arange(20) >= 13 for view in VIEWS for how in ("init", "ES")},
        index=SCENARIOS, dtype=float,
    )  # fmt: skip
    figure = figures.survival(crowding, met.iloc[::-1], 0.4)
    assert figure.finding.endswith("rank correlation 0.40, with extrapolation")
    for axes in figure.axes:
        for line in axes.get_lines():
            assert line.get_ydata().tolist() == [1, 6 / 6, 0]


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
    ends = dict(zip(ARMS, (0.9, 0.92, 0.95, 1.2, 1.3), strict=True))
    shares = {arm: [np.linspace(1, end, 60)] * 4 for arm, end in ends.items()}
    figure = figures.shifts(shares, 150)
    assert "costs 90% of replanning" in figure.finding
    assert "120% if it never is" in figure.finding
    told, never = figure.axes
    assert told.get_lines()[2].get_xdata()[[0, -1]].tolist() == [5, 300]
    assert len(told.get_lines()) + len(never.get_lines()) == len(ARMS) + 4  # and the dotted ones
