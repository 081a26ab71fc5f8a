"""A learned model and richer terminal costs begin as the paper's, with gradients that are right."""

import numpy as np
import pytest

from nmpcrl.studies.worlds_problems import TERMINALS, controller, problem
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
LAYOUT = paper.LAYOUTS["A"]


@pytest.mark.parametrize("richer", [{"learned_model": True}, *({"terminal": t} for t in TERMINALS)])
def test_theta_begins_with_the_papers(richer):
    np.testing.assert_array_equal(problem(**richer).theta[:9], THETA)


@pytest.mark.weekly
@pytest.mark.slow
@pytest.mark.parametrize("terminal", TERMINALS[1:])
def test_a_richer_terminal_cost_begins_as_the_papers_and_can_become_another(terminal):
    richer, data = controller(terminal=terminal), {"centres": np.array(LAYOUT)}
    theta, state = richer.nmpc.problem.theta, np.array([4.0, 1.4, -0.3])
    np.testing.assert_array_equal(theta[:9], THETA)
    printed, same = (one.solve(state, each, data=data)
                     for one, each in ((controller(), THETA), (richer, theta)))  # fmt: skip
    assert same.value == pytest.approx(printed.value, rel=1e-9)
    for k in range(9, theta.size):
        step = 1e-5 * np.eye(theta.size)[k]
        ahead, behind = (
            richer.solve(state, one, data=data).value for one in (theta + step, theta - step)
        )
        assert same.features[k] == pytest.approx((ahead - behind) / 2e-5, rel=1e-3, abs=1e-4)
        assert same.features[k] != 0
