"""The figures of other people's problems: their titles follow from what they are given."""

import numpy as np
import pytest

from nmpcrl.report.figures.learners import other_problems as draw
from nmpcrl.studies.other_problems import OTHER_PROBLEMS, runs


@pytest.fixture(scope="module")
def found():
    return runs(OTHER_PROBLEMS.table())


def test_the_arm_that_ends_lowest_is_named_and_each_has_one_entry(found):
    figure = draw.courses(found)
    medians = {arm: np.median(costs) for arm, costs in found.tests.items()}
    assert figure.get_suptitle().startswith(f"{min(medians, key=medians.get)} ends lowest, at")
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == list(medians)


def test_runs_at_the_upper_edge_are_counted(found):
    lost = (found.courses.test >= draw.MOST).sum()
    assert draw.ends(found).get_suptitle().startswith(f"{lost} of {len(found.courses)} runs")


def test_each_seed_is_a_line_over_the_ways_of_running_it(found):
    figure = draw.spreads(found)
    left = figure.axes[0]
    assert sum(len(line.get_xdata()) == 4 for line in left.get_lines()) == len(found.spreads)
    apart = abs(found.spreads["ipopt"] / found.spreads["ipopt, 1e-10"] - 1)
    assert f"by up to {max(apart):.0%}" in figure.get_suptitle().replace("\n", " ")


def test_the_learner_that_ends_nearest_is_named():
    paths = {"ES": np.array([[0, 0], [1, 0.5]]), "QL": np.array([[0, 0], [1.0, 1.1]])}
    figure = draw.gains(paths, np.ones(2))
    assert figure.get_suptitle() == "QL ends nearest to the best K"
