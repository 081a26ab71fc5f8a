"""When a network saves time, from times whose curve is known."""

import numpy as np
import pytest

from nmpcrl.bench.learners import ratio
from nmpcrl.bench.saving import Saving, saving
from nmpcrl.claims import published


def model(**changed) -> Saving:
    """Two solvers; a fit takes longer beside the slow one, which gains less from a warm start."""
    parts = {
        "solve": [0.05, 1.0],
        "warm": [0.7, 0.8],
        "network": [0.1, 0.2],
        "rest": [0.02, 0.03],
        "rest_rdes": [0.02, 0.05],
    }
    return Saving(**{name: np.array(one) for name, one in (parts | changed).items()})


def test_the_ratio_breaks_even_within_its_interval_and_goes_through_the_published_ones():
    two = model()
    assert two.ratio(1e9) == pytest.approx(1 / 1.6)
    assert two.ratio(1e9, warm=1.0) == pytest.approx(0.5)
    assert two.ratio(two.break_even) == pytest.approx(1.0)
    same = model(warm=[1.0, 1.0], network=[0.2, 0.2], rest=[0.03, 0.03], rest_rdes=[0.05, 0.05])
    assert same.break_even == pytest.approx(0.22)
    assert same.break_even_within == pytest.approx((0.22, 0.22))
    assert (np.diff(same.ratio(np.geomspace(0.01, 1e3))) < 0).all()
    low, high = model().break_even_within
    assert low < model().break_even < high
    assert (low, high) == pytest.approx((0.1 / 0.6, 0.22 / 0.4))
    for early in (True, False):  # all changes at the fast end, or at the slow one
        at = (0.051, 1.0) if early else (0.05, 0.999)
        assert low <= model(solve=np.array(at)).break_even <= high
    slow = model(solve=[10.0, 100.0])
    assert slow.break_even < 10
    assert np.isnan(slow.break_even_within).all()
    free = model(network=[0.0, 0.0], rest_rdes=[0.0, 0.0], rest=[0.02, 0.02])
    assert free.break_even == 0
    never = model(warm=[0.4, 0.4])
    assert never.break_even == np.inf
    assert np.isnan(never.break_even_within).all()
    timings = published.load().timings
    for row in timings[timings.learner == "RDES"].itertuples():
        measured = ratio(timings, row.solver, "RDES").value
        assert saving(timings).ratio(row.ms_per_solve) == pytest.approx(measured, rel=1e-6)
