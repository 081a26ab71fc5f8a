"""Figures of remedies: what lies beyond the axes is marked."""

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.analysis.suite import Judgement
from nmpcrl.report.figures.verdicts.remedies import DEAREST, by_budget, gains
from nmpcrl.studies.remedies import ADVISED, FIRST, NEVER, SECOND, RemedyRow


def row(entry, word, part, *gain):
    solved = Estimate(0.9, 0.8, 0.95)
    made = RemedyRow(part, entry, entry, Estimate(*gain), solved, 120, 2, 49, 0.5, False)
    return made._asdict() | {"word": word}


def test_each_budget_has_a_mark_and_an_arrow_is_for_what_lies_beyond_the_axis():
    short, long = ADVISED
    rows = [
        row("CMA-ES", FIRST, short, 0.8, 0.7, 0.9),
        row("CMA-ES", FIRST, long, 0.99, 0.98, 1.0),
        row("grid", SECOND, short, 0.7, 0.6, 0.8),
        row("DPG", NEVER, short, -np.inf, -np.inf, -0.2),
    ]
    figure = gains(pd.DataFrame(rows), "a finding")
    (axes,) = figure.axes
    assert next(text.get_text() for text in axes.get_yticklabels()) == "CMA-ES: first"
    marks = [line.get_marker() for line in axes.get_lines() if len(line.get_xdata()) == 1]
    assert (marks.count("o"), marks.count("<")) == (3, 1)


def test_what_did_not_arrive_is_crossed_and_what_costs_too_much_stands_at_the_edge():
    made = [
        Judgement(100.0, 95.0, arrived=True, episodes=5, seconds=0.1),
        Judgement(100.0, 150.0, arrived=False, episodes=10, seconds=0.2),
    ]
    figure = by_budget([5, 10], {"ES": made, "grid": [made[0], made[0]]})
    assert figure.get_suptitle() == "With 10 episodes grid costs least: 95% of the start's cost"
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.texts] == ["150%"]
    crosses = [line.get_ydata() for line in axes.get_lines() if line.get_marker() == "x"]
    assert [len(one) for one in crosses] == [1, 0]
    assert crosses[0] == [DEAREST]
