"""Robots among obstacles that move: the title counts."""

import re

import numpy as np
import pytest

from nmpcrl.analysis.encounters import Contacts, Encounters
from nmpcrl.report.figures.runs import views as figures
from nmpcrl.studies.worlds import VIEWS
from nmpcrl.study import paper
from nmpcrl.study.moving import Straight

MOTIONS = (Straight((3.0, 3.0), (0.0, -0.1)), Straight((5.0, 1.0), (0.1, 0.0)))
INSIDE = dict(zip(VIEWS, (0, 7, 24), strict=True))


@pytest.fixture(scope="module")
def figure():
    way = np.linspace([-2.5, 1.5, 0.0], [8.5, 2.0, 0.0], paper.STEPS + 1)
    return figures.views(
        MOTIONS, {view: Encounters(way, 4000.0, Contacts(n, 1), True) for view, n in INSIDE.items()}
    )


def test_the_title_counts_the_states_inside(figure):
    assert [int(n) for n in re.findall(r"\d+", figure.finding)] == [*INSIDE.values()]
