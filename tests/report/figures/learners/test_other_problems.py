"""The figure of problems whose answer is known."""

import numpy as np

from nmpcrl.report.figures.learners import other_problems as draw
from nmpcrl.studies.other_problems import OTHER_PROBLEMS, runs


def test_each_learner_has_a_row_with_every_seed_and_diverged_runs_stand_at_the_edge():
    found = runs(OTHER_PROBLEMS.table())
    paths = {"ES": np.array([[0, 0], [1, 0.5]]), "LSTD-Q": np.array([[0, 0], [1.0, 1.1]])}
    above, below = draw.known(paths, np.ones(2), found).axes
    assert [text.get_text() for text in above.get_legend().get_texts()] == [*paths, "best K"]
    clouds = [line.get_xdata() for line in below.get_lines() if len(line.get_xdata()) > 2]
    assert len(clouds) == found.tests.shape[1]
    for cloud, costs in zip(clouds, found.tests.to_numpy().T, strict=True):
        assert len(cloud) == len(costs)
        assert (cloud == draw.MOST).sum() == (costs >= draw.MOST).sum()
