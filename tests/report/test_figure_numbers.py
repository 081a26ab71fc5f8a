"""What figures draw is what was computed: bars are counts, and no run is lost."""

import numpy as np
import pandas as pd
import pytest
from builders import evidence_of as made_up

from nmpcrl.analysis.statistics import Estimate, rate
from nmpcrl.claims import thresholds
from nmpcrl.claims.paper_claims import BY_RUNS, CLAIMS
from nmpcrl.claims.rule import Observations
from nmpcrl.report.figures import (
    claims,
    comparisons,
    controller,
    layouts,
    results,
    speed,
    trials,
)
from nmpcrl.report.figures.style import LOOKS, TEAL
from nmpcrl.studies.remedies import ADVISED
from nmpcrl.study import Experiment, paper

SEEDS = 4
PAIRS = 2 * 2 * SEEDS  # layouts, decays, seeds
FAST = np.ones((5, 2))  # 1 m/s, and the robot's bound is 0.6
# Between the last two obstacles of layout A, whose gap closes at theta_c = 0.36.
WAY = np.array([[-2.5, 1.5, 0.0], [5.5, 0.5, 0.0], [7.5, 2.5, 0.0], [8.5, 2.0, 0.0]])


def in_one_layout(e: Experiment) -> dict:
    """In layout A alone DES diverges, ES swings, and RDES goes into obstacles and saves nothing."""
    there = e.layout == "A"
    changes = {
        "DES": {"training": 2.0 if there else 1.0},
        "ES": {"swing": 0.1 * there},
        "RDES": {
            "end": 1.2 if there else 0.9,
            "imitation": (1.0, 1.0) if there else (0.1, 1.0),
            "inside": (0, 0, 5 * there),
        },
    }
    return changes.get(e.learner, {})


def drawn(claim, found):
    verdict = CLAIMS[claim].judge(Observations(found.runs, found.paths))
    return verdict, claims.measured(found, verdict)


def points(axes) -> np.ndarray:
    """Where a panel's points are, shape (points, 2)."""
    dots = [line for line in axes.get_lines() if line.get_linestyle() == "None"]
    return np.array([xy for line in dots for xy in line.get_xydata()])


@pytest.mark.parametrize("claim", ["C1", "C2", "C5", "C6", "C7", "C9"])
def test_a_claim_s_shares_are_those_of_its_verdict_with_wilson_s_interval(claim):
    verdict, figure = drawn(claim, made_up(in_one_layout))
    panel = figure.axes[-1]
    labels = [tick.get_text() for tick in panel.get_yticklabels()]
    names = ["all", "A", "D", "step", "episode"]
    bars = [lines.get_segments()[0] for lines in panel.collections]
    for label, name, (x, y), bar in zip(labels, names, points(panel), bars, strict=True):
        yes, of = verdict.counts[name]
        expected = rate(yes, of)
        assert label.removeprefix("per ") == f"{name}  {yes}/{of}"
        np.testing.assert_allclose([x, *bar[:, 0]], [expected.value, expected.low, expected.high])
        assert y == names.index(name)
    yes, of = verdict.counts["all"]
    assert figure.finding.startswith(f"{claim} {verdict.words}: ")
    assert f" in {yes} of {of} " in figure.finding


def test_stopped_runs_are_drawn_beyond_all_others_and_a_median_is_one_of_the_runs():
    unlike = {True: {"reached": 40}, False: {"training": 2.0}}
    found = made_up(lambda e: unlike[e.seed == 0] if e.learner == "DES" else {})
    panel = drawn("C1", found)[1].axes[0]
    heights = points(panel)[:, 1]
    beyond = heights > 2.0 + 1e-9  # DES costs twice as much
    assert len(heights) == 2 * PAIRS
    assert beyond.sum() == PAIRS / SEEDS
    assert "∞" in [text.get_text() for text in panel.texts]
    found = made_up(lambda e: {"reached": 40} if e.learner == "RDES" and e.seed < 2 else {})
    panel = drawn("C9", found)[1].axes[0]
    medians = [path.vertices[0, 1] for lines in panel.collections for path in lines.get_paths()]
    assert len(medians) == 2 * PAIRS / SEEDS
    assert {*np.round(medians, 9)} <= {*points(panel)[:, 1].round(9)}


def test_a_pair_that_is_apart_and_a_run_that_touches_are_drawn_above_the_threshold():
    aside = made_up().summaries[Experiment("RDES")].states.copy()
    aside[2, 1] -= 1.0
    found = made_up(lambda e: {"states": aside} if (e.learner, e.layout) == ("RDES", "A") else {})
    heights = points(drawn("C5", found)[1].axes[0])[:, 1]
    apart = heights[heights > BY_RUNS["C5"].threshold]
    np.testing.assert_allclose(apart, [1.0 / thresholds.SAME_PATH] * (PAIRS // 2))
    assert len(heights) == PAIRS
    assert len(points(drawn("C7", made_up())[1].axes[0])) == PAIRS


def test_the_profile_falls_from_all_runs_to_none_and_counts_those_that_were_stopped():
    found = made_up(lambda e: {"reached": 40} if e.learner == "DES" and e.seed == 0 else {})
    curves = {one.get_label(): one.get_ydata() for one in claims.learners(found, "").axes[0].lines}
    assert (curves["ES"][0], curves["DES"][0]) == (1.0, 1 - 1 / SEEDS)
    for curve in curves.values():
        assert (np.diff(curve) <= 0).all()
        assert curve[-1] == 0.0


@pytest.mark.parametrize(("learner", "claim"), [("RDES", "C3"), ("GES", "C4")])
def test_a_bar_is_as_long_as_the_ratio_that_a_verdict_on_time_rests_on(timings, learner, claim):
    verdict = CLAIMS[claim].judge(Observations(timings=timings))
    panel = claims.times(timings, verdict, learner).axes[0]
    rest = panel.containers[-1]  # the last part of each bar
    chosen = timings[timings.learner.isin(["ES", learner])]
    assert [bar.get_x() + bar.get_width() for bar in rest] == pytest.approx([*chosen.ratio])


def test_bars_count_the_runs_of_each_learner_by_mechanism_and_by_ending():
    changes = {"DES": {"end": 1.2, "alpha_phi2": 3.0}, "RDES": {"end": 1.2}}
    found = made_up(lambda e: {"reached": 40} if (e.learner, e.seed) == ("RDES", 0)
                    else changes.get(e.learner, {}))  # fmt: skip
    figure = results.reasons(found)
    signs, ends = (
        np.array([[bar.get_width() for bar in part] for part in panel.containers]).T
        for panel in figure.axes
    )
    assert [one.get_text() for one in figure.axes[0].get_yticklabels()][1:3] == ["DES", "RDES"]
    assert (signs[1, 0], signs[2, 4], signs[0, 5]) == (16, 16, 16)
    assert (ends[2, 0], ends[2, 5]) == (4, 12)  # stopped in training, arrived
    assert (signs.sum(axis=1) == 16).all()
    assert (ends.sum(axis=1) == 16).all()
    assert figure.finding == "32 of 80 runs failed"


# The paper's figures


def test_costs_are_in_units_of_the_start_and_infinite_where_a_run_was_cut_short():
    run = next(iter(made_up(lambda e: {"end": 0.8, "training": 1.5}).summaries.values()))
    np.testing.assert_allclose(results.trained(run)[1], 1.5)
    np.testing.assert_allclose(results.judged(run)[1], [1.0, *[0.8] * 30])
    run = next(iter(made_up(lambda e: {"reached": 100}).summaries.values()))
    run.episodes["cost"][3] = np.nan
    episodes, cost = results.trained(run)
    assert episodes[np.isinf(cost)].tolist() == [4, *range(101, 301)]
    due, judged = results.judged(run)
    assert due[np.isinf(judged)].tolist() == list(range(110, 301, 10))


def curves(found, pair=("DES", "RDES"), layout="A"):
    return results.learning_curves(found, pair, layout, thresholds.divergence, "diverged")


def test_a_curve_off_the_scale_is_in_its_strip_and_a_band_holds_the_middle_half():
    found = made_up(lambda e: {"training": 2.0, "reached": 150 if e.decay == "episode" else None}
                    if (e.learner, e.layout) == ("DES", "A") else {})  # fmt: skip
    figure = curves(found)
    assert figure.finding == "In layout A, 8 of 8 runs of DES and 0 of 8 runs of RDES diverged"
    assert "0 of 8 runs of DES" in curves(found, layout="D").finding
    start, middle, stop = results.STRIP
    for panel in (figure.axes[1], figure.axes[3]):  # noise per episode: above and below
        assert panel.get_ylim()[1] == pytest.approx(stop)
        des, *others = (line.get_ydata() for line in panel.get_lines())
        assert (des[-1], max(des)) == (middle, middle)
        assert max(map(max, others)) < results.CEILING < start
    found = made_up(lambda e: {"end": 0.6 + 0.1 * e.seed}, seeds=(0, 1, 2, 3, 4))
    panel = curves(found, ("ES", "GES")).axes[2]
    band = panel.collections[1].get_paths()[0].vertices[:, 1]  # of ES, without noise
    assert (band.min(), band.max()) == (pytest.approx(0.7), pytest.approx(1.0))
    assert panel.get_lines()[0].get_ydata()[-1] == pytest.approx(0.8)


def test_endings_and_inputs_beyond_bounds_are_counted_and_stopped_runs_not_drawn():
    stuck = made_up().summaries[Experiment("RDES")].states.copy()
    stuck[2:] = stuck[1]
    changes = {("RDES", 0): {"states": stuck}, ("RDES", 1): {"reached": 50}}
    figure = results.trajectories(made_up(lambda e: changes.get((e.learner, e.seed), {})))
    assert figure.finding == "After 24 of 32 runs of RDES and GES the robot reaches the target"
    ways = [line for line in figure.axes[0].get_lines() if len(line.get_xdata()) == 5]
    assert len(ways) == 2 * (3 * SEEDS - 1)
    found = made_up(lambda e: {"actions": FAST} if (e.learner, e.seed) == ("GES", 0) else {})
    for evidence, count in ((made_up(), 0), (found, 10)):
        assert f"; {count} inputs leave their" in results.controls(evidence, "A").finding


def test_every_known_run_has_its_mark_and_what_is_beyond_lies_at_the_edge():
    found = made_up()
    values = pd.Series(0.0, found.runs.index)
    es, ges = (found.runs.index[found.runs.learner == name] for name in ("ES", "GES"))
    values[es[:3]], values[ges[:2]] = np.nan, [-np.inf, 0.7]
    look = {"seen": (-0.1, 0.2), "label": "gain", "title": "So it is"}
    figure = results.by_layout(found, values, ("ES", "GES"), **look)
    lines = [line for axes in figure.axes for line in axes.get_lines()]
    heights = {
        name: np.concatenate([one.get_ydata() for one in lines
                              if one.get_marker() == LOOKS[name].marker])
        for name in ("ES", "GES")
    }  # fmt: skip
    assert len(heights["ES"]) == len(es) - 3
    assert {heights["GES"].min(), heights["GES"].max()} == {-0.1, 0.2}


# Layouts


def test_only_narrow_gaps_are_drawn_from_centre_to_centre_and_name_the_layout():
    panel = layouts.layouts({"A": WAY}).axes[0]
    x, y, _ = paper.task("A").discs
    gaps = [line for line in panel.get_lines() if line.get_color() == TEAL]
    ends = {tuple(np.round(line.get_xydata().ravel(), 6)) for line in gaps}
    assert (x[2], y[2], x[3], y[3]) in ends
    assert all(abs(line.get_ydata()[1]) < 3 for line in gaps)  # no wall is near
    assert panel.get_title("left") == "A: open, +0.01 m"


# Others


def test_the_penalty_begins_where_it_was_computed_by_hand():
    figure = controller.penalty_gap(paper.task("A"), np.array([0.001, 0.35]), np.array([3.0, 1.0]))
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["the NMPC keeps 1.251 m", "the penalty begins at 1.452 m"]
    assert "theta_c = 0.35 has the lowest cost" in figure.finding


def test_layouts_of_the_cliffs_are_read_in_order_with_their_two_lines():
    costs = {name: (np.arange(3.0) + i, np.arange(3.0)) for i, name in enumerate("ABCDEF")}
    figure = layouts.cliffs(np.arange(3.0), costs, dict.fromkeys("ABCDEF", 0.3), "")
    for i, panel in enumerate(figure.axes):
        _, along, best = (line.get_xydata() for line in panel.get_lines())
        assert along[:, 1] * 1000 == pytest.approx(np.arange(3.0) + i)
        assert best[0, 0] == 0.3
        place = panel.get_subplotspec()
        assert (place.rowspan.start, place.colspan.start) == divmod(i, 2)


def test_a_share_beyond_the_axis_is_an_arrow_at_its_edge():
    gain = [Estimate(-np.inf, -np.inf, -0.2), Estimate(0.8, 0.7, 0.9)]
    rows = {"entry": ["DPG", "grid"], "word": ["never", "first"], "part": ADVISED[0], "gain": gain}
    lines = comparisons.gains(pd.DataFrame(rows), "").axes[0].get_lines()
    marks = {line.get_marker(): line.get_xdata()[0] for line in lines if len(line.get_xdata()) == 1}
    assert marks == {"<": comparisons.LEAST, "o": 0.8}


def test_what_did_not_end_at_the_target_is_crossed_out():
    there = np.linspace(paper.START, paper.TARGET, 30)
    ways = dict.fromkeys(comparisons.WAYS, there)
    figure = comparisons.trajectories({"A": ways, "B": ways | {"learned": there[:15]}})
    crosses = [sum(line.get_marker() == "X" for line in axes.lines) for axes in figure.axes[:2]]
    assert crosses == [0, 1]
    assert "arrives in 1 of 2 layouts after learning, in 2 " in figure.finding


def test_a_world_that_changes_is_drawn_by_the_median_of_its_runs_and_quartiles_that_are_runs():
    ends = [0.8, 0.9, 1.2, 1.3]
    shares = {arm: [np.linspace(1, end, 60) for end in ends] for arm in comparisons.ARMS}
    panel = comparisons.shifts(shares, 150).axes[0]
    assert panel.get_lines()[2].get_xydata()[-1] == pytest.approx([300, np.median(ends)])
    band = panel.collections[0].get_paths()[0].vertices[:, 1]
    assert (band.min(), band.max()) == pytest.approx((0.8, 1.2))
    assert "costs 105% of replanning" in comparisons.shifts(shares, 150).finding


def test_the_infinite_cost_of_a_lost_run_is_not_drawn():
    rows = pd.DataFrame({"learner": "mine", "seed": 0, "episode": [0, 5], "cost": [7.0, np.inf]})
    (line,) = trials.costs(rows).axes[0].get_lines()
    assert np.isfinite(line.get_ydata()).tolist() == [True, False]


def test_every_solver_and_the_paper_have_a_point(timings):
    figure = speed.saving(timings, {"ipopt MX": 4.0, "rebuilt": 40.0})
    marks = [line for line in figure.axes[0].lines if len(line.get_xdata()) == 1]
    at = [float(line.get_xdata()[0]) for line in marks if line.get_marker() != "None"]
    assert at == pytest.approx([0.04, 0.8, 2.0, 4.0, 40.0, 830.0], rel=0.01)
