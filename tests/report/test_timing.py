"""Ratios of times."""

import pytest

from nmpcrl.report import timing


def test_slow_solves_give_one_half_only_where_all_take_alike(timings):
    timings.loc[timings.learner == "ES", "ms_per_solve"] *= 0.8
    assert timing.ratios_at_paper_speed(timings) == pytest.approx((0.50, 0.63), abs=0.005)


def test_a_ratio_has_its_interval_and_carries_what_it_is_of(timings):
    row = timings.set_index(["solver", "learner"]).loc["ipopt", "RDES"]
    shown = str(timing.to_es(timings, "ipopt", "RDES"))
    assert f">{row.ratio:.2f} [{row.ratio_low:.2f}, {row.ratio_high:.2f}]</data>" in shown
    assert 'title="step of RDES in steps of ES, with ipopt: the published measurement"' in shown
    assert f">{row.ratio:.3f}</data>" in f"{timing.to_es(timings, 'ipopt', 'RDES'):.3f}"
    with pytest.raises(KeyError):
        timing.to_es(timings, "scipy", "RDES")
