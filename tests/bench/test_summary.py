"""From measured columns to numbers and verdicts; no clock is read here."""

import re

import numpy as np
import pytest

from nmpcrl.bench import summary, targets
from nmpcrl.bench.solves import LOOPS
from nmpcrl.claims import published
from nmpcrl.report import tables
from nmpcrl.study import paper


def outcomes(measured) -> dict[str, bool | None]:
    return {target.what: target.reached for target in targets.targets(measured)}


def missed(measured) -> list[str]:
    return [what for what, reached in outcomes(measured).items() if reached is False]


def test_the_paper_s_hours_are_0_83_s_a_solve():
    assert pytest.approx(0.83, abs=0.005) == summary.PAPER_SOLVE


def test_a_cold_solve_does_not_count(measured):
    table = summary.solvers(measured)
    assert table.loc[("with noise", "riccati"), "max"] == pytest.approx(40.0)
    assert table.loc[("with noise", "fatrop"), "times"] == pytest.approx(20.0)


def test_one_solve_in_twenty_is_slower_than_p95():
    times = np.arange(21) * 1e-6
    loops = {"loop": np.repeat(list(LOOPS), 21), "seconds": np.tile(times, len(LOOPS))}
    for _, row in summary.own_loop({"loop": loops}).iterrows():
        assert row.to_dict() == pytest.approx({"median": 10.0, "p95": 19.0, "max": 20.0})


def test_a_value_above_the_best_is_a_worse_minimum_and_no_value_a_failure(measured):
    solves = measured["solves"]
    warm = [
        i
        for i, (loop, solver) in enumerate(zip(solves["loop"], solves["solver"], strict=True))
        if (loop, solver) == ("with noise", "ipopt") and solves["warm"][i]
    ]
    solves["suboptimality"][warm[0]] = 2e-6
    solves["suboptimality"][warm[1]] = 0.5e-6
    solves["suboptimality"][warm[2]] = solves["iterations"][warm[2]] = None
    row = summary.solvers(measured).loc[("with noise", "ipopt")]
    assert row.worse == pytest.approx(1 / 4)
    assert row.failed == pytest.approx(1 / 4)
    assert row.iterations == pytest.approx(5)


def test_a_run_of_the_paper_s_length_is_taken_as_it_is(measured):
    assert summary.runs(measured).seconds["ES"] == 4.0


def test_a_shorter_run_is_extended_by_its_later_episodes(measured):
    measured["runs"]["episodes"] = [30] * 4
    measured["runs"]["seconds"] = [2.0] * 4
    episodes = measured["episodes"]
    kept = [i for i, episode in enumerate(episodes["episode"]) if episode <= 30]
    measured["episodes"] = {name: [column[i] for i in kept] for name, column in episodes.items()}
    seconds = summary.runs(measured).seconds["ES"]
    assert seconds == pytest.approx(2.0 + (paper.EPISODES - 30) * 0.01)
    assert any("extended from 30 episodes" in t.measured for t in targets.targets(measured))


def test_memory_grows_from_a_tenth_of_the_episodes_on(measured):
    memory = measured["episodes"]["memory"]
    memory[:5] = [300_000_000] * 5  # while things are loaded
    memory[299] = 480_000_000
    assert summary.runs(measured).memory_growth["ES"] == pytest.approx(0.2)
    assert missed(measured) == ["memory of a run"]


@pytest.mark.parametrize(("varied", "each"), [("horizon", 0.5), ("obstacles", 0.25)])
def test_what_one_more_adds_is_constant_where_time_is_linear(measured, varied, each):
    assert summary.marginal(measured, varied) == pytest.approx((each, each))
    assert summary.most_per_part(measured, varied) == pytest.approx(1.0)


def test_quadratic_growth_is_seen(measured):
    grown = measured["scaling"]
    grown["seconds"] = [1e-8 * size**2 for size in grown["size"]]
    assert summary.most_per_part(measured, "horizon") == pytest.approx(80 / 5)
    assert len(missed(measured)) == 2


def test_growth_beside_a_large_cost_of_every_call_is_seen_by_what_one_more_adds(measured):
    grown = measured["scaling"]
    grown["seconds"] = [1e-3 + 1e-8 * size**2 for size in grown["size"]]
    assert summary.most_per_part(measured, "horizon") == pytest.approx(1.0)
    assert len(missed(measured)) == 2


def model(**changed) -> summary.Saving:
    """Two solvers; a fit takes longer beside the slow one, which gains less from a warm start."""
    parts = {
        "solve": [0.05, 1.0],
        "warm": [0.7, 0.8],
        "network": [0.1, 0.2],
        "rest": [0.02, 0.03],
        "rest_rdes": [0.02, 0.05],
    }
    return summary.Saving(**{name: np.array(one) for name, one in (parts | changed).items()})


def test_the_ratio_of_the_learners_breaks_even_where_it_says_and_comes_down_to_what_u_allows():
    two = model()
    assert two.ratio(1e9) == pytest.approx(1 / 1.6)
    assert two.ratio(1e9, warm=1.0) == pytest.approx(0.5)
    assert two.ratio(two.break_even) == pytest.approx(1.0)
    assert two.ratio(two.solve_at(0.65)) == pytest.approx(0.65)
    assert two.solve_at(0.6) == np.inf


def test_with_solves_that_take_alike_it_is_the_equation_without_u():
    same = model(warm=[1.0, 1.0], network=[0.2, 0.2], rest=[0.03, 0.03], rest_rdes=[0.05, 0.05])
    assert same.break_even == pytest.approx(0.22)
    assert same.break_even_within == pytest.approx((0.22, 0.22))
    assert (np.diff(same.ratio(np.geomspace(0.01, 1e3))) < 0).all()


def test_the_break_even_lies_within_its_interval_whatever_way_leads_from_solver_to_solver():
    low, high = model().break_even_within
    assert low < model().break_even < high
    assert (low, high) == pytest.approx((0.1 / 0.6, 0.22 / 0.4))
    for early in (True, False):  # all changes at the fast end, or at the slow one
        at = (0.051, 1.0) if early else (0.05, 0.999)
        assert low <= model(solve=np.array(at)).break_even <= high


def test_a_break_even_that_is_not_between_two_solvers_is_none():
    slow = model(solve=[10.0, 100.0])
    assert slow.break_even < 10
    assert np.isnan(slow.break_even_within).all()
    free = model(network=[0.0, 0.0], rest_rdes=[0.0, 0.0], rest=[0.02, 0.02])
    assert free.break_even == 0
    never = model(warm=[0.4, 0.4])
    assert never.break_even == np.inf
    assert np.isnan(never.break_even_within).all()


def test_the_curve_goes_through_what_was_measured(measured):
    table = summary.learners(measured)
    curve, ran = summary.saving(table), summary.measured_ratios(table)
    assert list(ran.index) == ["riccati", "fatrop", "ipopt"]
    assert ran.ratio.to_numpy() == pytest.approx(curve.ratio(ran.solve.to_numpy()))


def test_the_curve_goes_through_the_published_ratios():
    """And so a bar of parts ends at the ratio that is written beside it."""
    timings = published.load().timings
    curve, ran = summary.saving(timings), summary.measured_ratios(timings)
    assert ran.ratio.to_numpy() == pytest.approx(curve.ratio(ran.solve.to_numpy()), rel=1e-6)


def test_what_was_not_measured_is_unknown(measured):
    measured["parallel"] = {"workers": [], "seconds": [], "runs": [], "episodes": []}
    measured["mpcrl"] = {"learner": [], "seconds": []}
    measured["first"] = {name: column[1:] for name, column in measured["first"].items()}
    assert np.isnan(summary.speed_up(measured)[1])
    assert np.isnan(summary.against_mpcrl(measured)).all()
    assert np.isnan(summary.first_call(measured, cached=False)[0])
    unknown = [what for what, reached in outcomes(measured).items() if reached is None]
    assert len(unknown) == 3
    assert not missed(measured)


def test_every_figure_can_be_reached(measured):
    assert len(outcomes(measured)) == 16
    assert all(outcomes(measured).values())


@pytest.mark.parametrize(
    ("part", "column", "value", "count"),
    [
        ("loop", "seconds", 46e-6, 2),
        ("runs", "seconds", 23.0, 4),
        ("parallel", "seconds", 10.0, 1),
        ("mpcrl", "seconds", 1e-3, 1),
        ("first", "notice", False, 1),
        ("first", "solve", 41.0, 2),
        ("episodes", "memory", 700_000_000, 1),
        ("solves", "seconds", 1e-3, 3),
    ],
)
def test_every_figure_can_be_missed(measured, part, column, value, count):
    measured[part][column] = [value] * len(measured[part][column])
    assert len(missed(measured)) == count


def test_a_run_that_had_to_share_the_processor_says_so(measured):
    measured["runs"]["processor"][0] = 3.0
    (told,) = [t.measured for t in targets.targets(measured) if "the processor" in t.measured]
    assert told == "4.0 s, of which the processor 75%"


def test_numbers_that_are_shown_alike_are_given_once(measured):
    shown = [target.measured for target in targets.targets(measured)]
    assert sum(bool(re.search(r"one more adds \d\.\d\d µs", one)) for one in shown) == 2
    assert sum(one.startswith("no growth; one more adds") for one in shown) == 2
    assert sum(one.endswith("x with and without noise") for one in shown) == 3
    assert any(one.endswith("unchanged after the first tenth") for one in shown)
    measured["episodes"]["memory"][-1] *= 1.02
    assert any("2.0% after" in one.measured for one in targets.targets(measured))


def test_the_table_has_a_row_and_a_badge_for_every_figure(measured):
    measured["loop"]["seconds"] = [1e-3] * 10
    html = tables.target_table(targets.targets(measured), "some machine")
    assert html.count("<tr>") == 1 + 16
    assert html.count(">missed<") == 2
    assert html.count(">reached<") == 14


def test_the_printed_table_has_the_same_rows(measured):
    shown = targets.shown(targets.targets(measured)).splitlines()
    header, *rows = ([cell.strip() for cell in line.split(" | ")] for line in shown)
    assert header == ["what", "target", "measured", "outcome"]
    assert [row[0] for row in rows] == list(outcomes(measured))


def test_a_ratio_that_json_could_not_hold_is_not_known(measured):
    measured["learners"]["ratio_low"] = [None] * len(measured["learners"]["ratio_low"])
    ratios = summary.measured_ratios(summary.learners(measured))
    assert np.isfinite(ratios.ratio).all()
    assert summary.learners(measured).ratio_low.isna().all()
