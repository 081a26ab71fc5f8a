"""Figures of random layouts: every claim and measure has its row."""

from itertools import cycle, pairwise

import pandas as pd
import pytest

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED
from nmpcrl.report.figures.verdicts import population as figures
from nmpcrl.studies.difficulty import MEASURES, PILOT
from nmpcrl.studies.population import EXPECTED, shares


def where(**holding):
    """Of each claim, in how many of forty layouts it holds."""
    rows = [
        (name.replace("_", " "), f"J{i:03}", int(i < count), 1, i < count, i < count)
        for name, count in holding.items()
        for i in range(40)
    ]
    return pd.DataFrame(rows, columns=["claim", "layout", "yes", "of", "holds", "weaker"])


def test_a_row_has_the_mark_of_its_outcome_and_the_share_of_the_six_layouts():
    found = shares(where(C1=10, C2=0, ES_improves=38))
    six = shares(where(C1=20, C2=2))
    figure = figures.shares(found, six, "Few hold")
    (axes,) = figure.axes
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert names == [
        "C1: DES diverges, RDES does not",
        "C2: ES is unstable, GES is not",
        "ES improves",
    ]
    marks = {outcome: look[1] for outcome, look in figures.LOOK.items()}
    drawn = [line.get_marker() for line in axes.get_lines() if len(line.get_xdata()) == 1]
    assert drawn == [marks[PARTLY], "|", marks[NOT], "|", marks[REPRODUCED]]


def test_no_two_claims_are_written_over_each_other():
    found = shares(where(**dict(zip(EXPECTED, cycle((0, 20, 40)), strict=False))))
    assert found.outcome.nunique() == 3  # each has its entry in the legend
    figure = figures.shares(found, found, "")
    figure.draw_without_rendering()  # lays it out
    boxes = [text.get_window_extent() for text in figure.axes[0].get_yticklabels()]
    assert len(boxes) == len(EXPECTED)
    assert all(above.y0 >= below.y1 for above, below in pairwise(boxes))


@pytest.mark.parametrize(("pilot", "place"), [(0.9, 0), (0.55, 8)])
def test_measures_are_ordered_by_their_area_and_runs_lie_at_the_edge_at_most(pilot, place):
    areas = {name: Estimate(0.6, 0.5, 0.7) for name in MEASURES}
    areas[PILOT] = Estimate(pilot, 0.5, 1.0)
    scores = pd.DataFrame({"auc": areas})
    costs = {"final_cost": [9.0, 9.0, 11.0], "initial_cost": 10.0, "stopped": "finished"}
    runs = pd.DataFrame(costs | {"theta_8": [0.2, -1.0, 3.0]})
    figure = figures.predictors(scores, runs, pd.Series([0.7, 1.0, 0.1]), "It tells")
    left, right = figure.axes
    well, ill = (line.get_xydata().tolist() for line in left.get_lines()[:2])
    assert well == [[0.7, 0.2], [1.0, figures.SHOWN]]
    assert ill == [[0.1, 3.0]]
    names = [text.get_text() for text in right.get_yticklabels()]
    assert names.index(figures.LABELS[PILOT]) == place
