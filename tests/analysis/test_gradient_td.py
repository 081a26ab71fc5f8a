"""The term that Eq. (16) drops: its size along a run of GES."""

import numpy as np
import pytest

from nmpcrl.analysis import metrics
from nmpcrl.analysis.gradient_td import directions, dropped_curvature
from nmpcrl.study import Experiment, paper, run


@pytest.fixture(scope="module")
def records():
    return run(Experiment("GES", episodes=2, steps=40, evaluate_every=2))


@pytest.fixture(scope="module")
def everywhere(records):
    """Measured at every step but the first."""
    return dropped_curvature(records, samples=10_000)


def test_samples_are_spread_and_the_printed_and_dropped_terms_are_theta_s_and_the_hessian_s(
    records, everywhere
):
    measured = dropped_curvature(records, samples=20)
    np.testing.assert_array_equal(measured.ratio, measured.dropped / measured.direction)
    assert 10 <= len(measured.ratio) <= 20
    assert set(measured.episode) == {0, 1}
    assert (np.diff(measured.episode) >= 0).all()
    steps = records.steps
    went = np.diff(np.vstack([records.experiment["theta"], steps["theta"]]), axis=0) / paper.ALPHA
    lengths = np.linalg.norm(went, axis=1)[1:]
    assert len(everywhere.direction) == len(lengths)
    close = np.isclose(everywhere.direction, lengths, rtol=1e-3)
    assert close.mean() > 0.95  # a cold solve may find another optimum
    k, t = 60, 1e-4
    steps = records.steps
    theta, w, delta = steps["theta"][k - 1], steps["w"][k - 1], steps["delta"][k]
    nmpc = paper.nmpc()
    solution = nmpc.solve(steps["state"][k], theta)
    unit = w / np.linalg.norm(w)
    after, before = (nmpc.solve(steps["state"][k], theta + s * t * unit, solution) for s in (1, -1))
    bend = np.linalg.norm(w) * (after.features - before.features) / (2 * t)
    h = (delta - solution.features @ w) * bend
    assert np.linalg.norm(h) == pytest.approx(everywhere.dropped[k - 1], rel=0.05)


def test_the_correction_of_ges_is_gamma_times_w_phi_times_the_next_features(records):
    """Against a second solve in the next state, at steps where the features are smooth."""
    parts, before = directions(records), metrics.theta_before(records)
    nmpc, steps = paper.nmpc(), records.steps
    for k in (10, 20, 30):
        solution = nmpc.solve(steps["state"][k], before[k])
        after = nmpc.solve(steps["state"][k + 1], before[k], solution)
        expected = paper.GAMMA * parts.predicted[k] * after.features
        np.testing.assert_allclose(parts.correction[k], expected, rtol=1e-3, atol=1e-3)
