"""Layouts: each criterion of the screening, and the widths of gaps."""

import numpy as np
import pytest

from nmpcrl.study import paper
from nmpcrl.study.layouts import gaps, screen

AWAY = ((0.0, 7.5), (3.0, 7.5), (5.5, 7.5), (8.0, 7.5))  # all at the upper wall
MIDDLE = (3.0, 1.75)  # of the straight line
EDGE = 1.25 * np.sqrt(1.35)  # of a penalty zone
(FIRST, SECOND, *OTHERS) = (np.array(centre) for centre in paper.LAYOUTS["A"])
NEARER = SECOND - 0.15 * (SECOND - FIRST) / np.linalg.norm(SECOND - FIRST)


def moved(*centres):
    """`AWAY` with its first obstacles elsewhere."""
    return (*centres, *AWAY[len(centres) :])


@pytest.mark.parametrize(
    ("centres", "blocked", "clear", "arrives", "kind"),
    [
        (AWAY, False, True, False, "open"),
        (moved(MIDDLE), True, True, True, "open"),
        (moved((3.0, 1.75 - 1.2)), True, True, True, "open"),
        (moved((3.0, 1.75 - 1.3)), False, True, False, "open"),
        *(
            (moved(MIDDLE, (x, y + EDGE + beyond)), True, beyond > 0, beyond > 0, "open")
            for x, y, _ in (paper.START, paper.TARGET)
            for beyond in (0.01, -0.01)
        ),
        ([(-0.6, y) for y in (-1.2, 0.8, 2.8, 4.8)], True, True, False, "open"),  # a wall
        (paper.LAYOUTS["A"], True, True, True, "open"),
        ((FIRST, NEARER, *OTHERS), True, True, True, "closing"),
    ],
)
def test_a_layout_meets_each_criterion_by_itself(centres, blocked, clear, arrives, kind):
    found = screen(centres)
    assert (found.blocked, found.clear, found.arrives, found.kind) == (
        blocked, clear, arrives, kind,
    )  # fmt: skip
    assert found.passed == (blocked and clear and arrives)


def test_a_gap_is_crossed_between_obstacles_or_at_a_wall_and_is_as_wide_as_plans_leave_it():
    path = np.mean([FIRST, SECOND], axis=0) + [[-0.5, -0.75], [0.5, 0.75]]
    apart = np.linalg.norm(FIRST - SECOND)
    assert gaps(paper.task(), path, 0.0)[0, 1] == pytest.approx(apart - 2 * 1.25)
    assert gaps(paper.task(), path, 0.44)[0, 1] == pytest.approx(apart - 2 * 1.25 * 1.2)
    below = SECOND + [[-1, -2.0], [1, -2.0]]
    assert gaps(paper.task(), below, 0.0)[1, -2] == pytest.approx(SECOND[1] + 3.0 - 1.25)
    assert (1, -2) not in gaps(paper.task(), below + [0, 4.0], 0.0)
    assert gaps(paper.task(), np.full((5, 2), [1.7, 1.4]), 0.0) == {}
