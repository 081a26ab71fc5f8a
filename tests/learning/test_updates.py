"""Every equation by hand."""

from functools import partial

import numpy as np
import pytest

from nmpcrl import learning
from nmpcrl.learning.updates import of_length

THETA, W = np.array([1.0, -2.0]), np.array([0.5, 0.25])
PHI, PHI_NEXT = np.array([2.0, 4.0]), np.array([1.0, -1.0])
HESSIAN = np.array([[0.0, 2.0], [2.0, 3.0]])  # times w: (0.5, 1.75)
GRADIENT_TD = partial(learning.gradient_td_step, THETA, W, 3.0, PHI, PHI_NEXT)


@pytest.mark.parametrize(
    ("step", "by_hand"),  # w'phi = 2
    [
        (lambda: learning.td_error(3.0, 0.5, q=10.0, q_next=8.0), -3.0),
        (lambda: learning.semi_gradient_step(THETA, 3.0, PHI, 0.1), [1.0 + 0.6, -2.0 + 1.2]),
        (lambda: GRADIENT_TD(alpha=0.1, gamma=0.5), [1.0 + 0.1 * (6 - 1), -2.0 + 0.1 * (12 + 1)]),
        (lambda: learning.auxiliary_step(W, 3.0, PHI, 0.1), [0.5 + 0.2, 0.25 + 0.4]),
        (lambda: learning.curvature_correction(3.0, PHI, W, HESSIAN @ W), [0.5, 1.75]),
        (lambda: learning.curvature_correction(5.0, PHI, W, HESSIAN @ W), [1.5, 5.25]),
        (lambda: learning.project(np.array([-1.0, 3.0, 12.0]), 0.0, 10.0), [0.0, 3.0, 10.0]),
        (lambda: learning.project(THETA, np.array([0.0, -1.0]), np.array([0.5, 1.0])), [0.5, -1.0]),
        (lambda: learning.project(np.array([np.nan, 1.0]), 0.0, 10.0), [np.nan, 1.0]),
        (lambda: of_length(np.zeros(3), 5.0), np.zeros(3)),
        (lambda: of_length(np.array([3.0, 0.0, -4.0]), 10.0), [6.0, 0.0, -8.0]),
    ],
)
def test_an_equation_by_hand(step, by_hand):
    before = [v.copy() for v in (THETA, W, PHI, PHI_NEXT)]
    np.testing.assert_allclose(step(), by_hand)
    for now, then in zip((THETA, W, PHI, PHI_NEXT), before, strict=True):
        np.testing.assert_array_equal(now, then)
