"""One figure a claim: its title is the verdict, its points are the runs, its intervals Wilson's."""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from nmpcrl.analysis.gradient_td import Curvature
from nmpcrl.analysis.statistics import rate
from nmpcrl.claims import thresholds
from nmpcrl.claims.paper_claims import CLAIMS
from nmpcrl.claims.published import Evidence
from nmpcrl.claims.rule import Observations
from nmpcrl.claims.verdict import Assumption, Verdict
from nmpcrl.report.figures.verdicts import claims as figures
from nmpcrl.study import Experiment
from nmpcrl.study.records import Records

LAYOUTS, DECAYS, SEEDS = 2, 2, 4
CELLS = LAYOUTS * DECAYS * SEEDS
RUN_CLAIMS = {
    "C1": (figures.measured, "DES diverged and RDES did not in 16 of 16 pairs"),
    "C2": (figures.measured, "ES was unstable and GES was not in 16 of 16 pairs"),
    "C5": (figures.same_policy, "RDES and GES end in the same policy in 16 of 16 pairs"),
    "C6": (
        figures.measured,
        "with θ as an input, the network's error is at most 0.8 times as large in 16 of 16 runs",
    ),
    "C7": (figures.violations, "all constraints held in 16 of 16 runs of RDES"),
    "C9": (figures.measured, "learning reduces the cost by 1% or more in 32 of 32 runs"),
}
TIMES = pd.DataFrame(
    {
        "solver": ["riccati"] * 3 + ["ipopt"] * 3,
        "learner": ["ES", "GES", "RDES"] * 2,
        "solves": [2.0, 2.0, 1.0] * 2,
        "ms_per_step": [0.1, 0.1, 0.2, 4.0, 4.0, 2.2],
        "ms_per_solve": [0.04, 0.04, 0.04, 1.99, 1.99, 2.0],
        "ms_per_fit": [np.nan, np.nan, 0.14] * 2,
        "ms_per_rest": [0.02, 0.02, 0.02, 0.02, 0.02, 0.06],
        "ratio": [1.0, 1.0, 2.0, 1.0, 1.0, 0.55],
        "ratio_low": [1.0, 0.95, 1.9, 1.0, 0.95, 0.5],
        "ratio_high": [1.0, 1.05, 2.1, 1.0, 1.05, 0.6],
        "waited": 0.0,
    }
)


def as_the_paper_says(experiment: Experiment) -> dict:
    """DES diverges, ES swings, and all else is well."""
    return (
        {"training": 2.0}
        if experiment.learner == "DES"
        else ({"swing": 0.1} if experiment.learner == "ES" else {})
    )


def verdict(found: Evidence, claim: str) -> Verdict:
    return CLAIMS[claim].judge(Observations(found.runs, found.paths))


@pytest.fixture(scope="module")
def as_said(made_up) -> Evidence:
    """All is as the paper says."""
    return made_up(as_the_paper_says)


@pytest.fixture(scope="module")
def in_one_layout(made_up) -> Evidence:
    """In layout A alone DES diverges, ES swings, and RDES goes into obstacles and saves nothing."""

    def unlike(experiment: Experiment) -> dict:
        there = experiment.layout == "A"
        changes = {
            "DES": {"training": 2.0 if there else 1.0},
            "ES": {"swing": 0.1 * there},
            "RDES": {
                "end": 1.2 if there else 0.9,
                "imitation": (1.0, 1.0) if there else (0.1, 1),
                "inside": (0, 0, 5 * there),
            },
        }
        return changes.get(experiment.learner, {})

    return made_up(unlike)


def title(figure: Figure) -> str:
    return " ".join(figure.get_suptitle().split())


def points(axis) -> np.ndarray:
    """Where a panel's points are, shape (points, 2)."""
    dots = [line for line in axis.get_lines() if line.get_linestyle() == "None"]
    return np.array([xy for line in dots for xy in line.get_xydata()])


def shares(axis) -> dict[str, tuple[float, float, float]]:
    """Share and interval by the label of the row."""
    labels = [tick.get_text() for tick in axis.get_yticklabels()]
    bars = {line.get_ydata()[0]: line for line in axis.get_lines() if len(line.get_xdata()) == 2}
    dots = {line.get_ydata()[0]: line for line in axis.get_lines() if line.get_marker() == "o"}
    return {
        label: (dots[row].get_xdata()[0], *bars[row].get_xdata())
        for row, label in enumerate(labels)
        if row in dots
    }


def drawn(claim: str, found: Evidence) -> Figure:
    return RUN_CLAIMS[claim][0](found, verdict(found, claim))


@pytest.mark.parametrize("claim", RUN_CLAIMS)
def test_the_title_is_the_verdict_and_what_it_rests_on(claim, as_said):
    assert title(drawn(claim, as_said)) == f"{claim} reproduced: {RUN_CLAIMS[claim][1]}"
    assert not plt.get_fignums()


@pytest.mark.slow
@pytest.mark.parametrize("claim", RUN_CLAIMS)
def test_the_shares_are_those_of_the_verdict_with_wilson_s_interval(claim, in_one_layout):
    found = in_one_layout
    one = verdict(found, claim)
    rows = shares(drawn(claim, found).axes[-1])
    names = ("all", "A", "D", "per step", "per episode")
    assert len(rows) == len(names)
    for (label, numbers), name in zip(rows.items(), names, strict=True):
        yes, of = one.counts[name.removeprefix("per ")]
        assert label == f"{name}  {yes}/{of}"
        expected = rate(yes, of)
        np.testing.assert_allclose(numbers, [expected.value, expected.low, expected.high])
    assert one.by_layout["A"] != one.by_layout["D"]


@pytest.mark.slow
def test_runs_that_were_stopped_are_drawn_beyond_all_others_and_not_dropped(made_up):
    found = made_up(
        lambda e: {"reached": 40} if (e.learner, e.seed) == ("DES", 0) else as_the_paper_says(e)
    )
    heights = points(drawn("C1", found).axes[0])[:, 1]
    assert len(heights) == 2 * CELLS
    beyond = heights > 2.0 + 1e-9  # DES costs twice as much
    assert beyond.sum() == LAYOUTS * DECAYS
    assert np.unique(heights[beyond]).size == 1
    texts = [text.get_text() for text in drawn("C1", found).axes[0].texts]
    assert "∞" in texts


def test_a_median_between_a_half_that_failed_and_one_that_did_not_is_one_of_them(made_up):
    found = made_up(lambda e: {"reached": 40} if e.learner == "RDES" and e.seed < 2 else {})
    axis = drawn("C9", found).axes[0]
    medians = [path.vertices[0, 1] for lines in axis.collections for path in lines.get_paths()]
    assert len(medians) == 2 * LAYOUTS * DECAYS
    assert set(np.round(medians, 9)) <= set(points(axis)[:, 1].round(9))


@pytest.mark.slow
def test_pairs_that_are_alike_lie_in_the_box_and_others_do_not(made_up):
    aside = made_up().summaries[Experiment("RDES")].states.copy()
    aside[2, 1] -= 1.0
    found = made_up(lambda e: {"states": aside, "end": 0.8} if e.learner == "RDES" else {})
    for drawing, inside in ((drawn("C5", made_up()), True), (drawn("C5", found), False)):
        for axis in drawing.axes[:-1]:
            places = points(axis)
            assert len(places) == LAYOUTS * SEEDS
            alike = (places <= [thresholds.SAME_PATH, thresholds.SAME_COST]).all(axis=1)
            assert (alike == inside).all()
    np.testing.assert_allclose(points(drawn("C5", found).axes[0]), [[1.0, 0.1]] * 8)


def test_states_in_an_obstacle_are_counted_by_size(made_up):
    found = made_up(lambda e: {"inside": (3, 2, 1)} if e.learner == "GES" else {})
    training, judged, _ = drawn("C7", found).axes
    assert [text.get_text() for text in training.texts] == ["0"] * 9 + ["48", "32", "16"]
    assert [text.get_text() for text in judged.texts] == ["0"] * 12
    assert len(points(training)) == len(points(judged)) == 4 * 3 * CELLS


# All learners


def test_the_profile_falls_from_all_runs_to_none_and_counts_those_that_were_stopped(made_up):
    found = made_up(lambda e: {"reached": 40} if e.learner == "DES" and e.seed == 0 else {})
    profile = figures.learners(found, "TDC ends lowest").axes[1]
    curves = {line.get_label(): line.get_ydata() for line in profile.get_lines()}
    assert curves["ES"][0] == 1.0
    assert curves["DES"][0] == pytest.approx(1 - 1 / SEEDS)
    for curve in curves.values():
        assert (np.diff(curve) <= 0).all()
        assert curve[-1] == 0.0


# Times and the theorem


@pytest.mark.parametrize(
    ("learner", "claim", "words"),
    [
        (
            "RDES",
            "C3",
            "C3 reproduced: with Ipopt, a step of RDES",
        ),
        ("GES", "C4", "C4 reproduced: with Ipopt, a step of GES"),
    ],
)
def test_a_bar_is_as_long_as_the_ratio_that_the_verdict_rests_on(learner, claim, words):
    figure = figures.times(TIMES, CLAIMS[claim].judge(Observations(timings=TIMES)), learner)
    ratio, shown = {"RDES": (0.55, "0.55 [0.50, 0.60]"), "GES": (1.0, "1.00 [0.95, 1.05]")}[learner]
    assert title(figure) == f"{words} takes {shown} of one of ES"
    bars = {round(patch.get_y(), 6) for patch in figure.axes[0].patches[1:]}
    assert len(bars) == 4  # two solvers, two learners
    ends = [patch.get_x() + patch.get_width() for patch in figure.axes[0].patches[1:]]
    assert ends[-1] == pytest.approx(ratio)
    assert ends[2] == pytest.approx(1.0)


def test_the_correlation_of_td_errors_is_drawn_lag_by_lag():
    rng = np.random.default_rng(0)
    delta = np.convolve(rng.normal(size=3000), np.ones(5), "valid")  # correlated over five steps
    experiment = {name: getattr(Experiment("GES"), name) for name in Experiment.__annotations__}
    records = Records(experiment, {"delta": np.append(delta, np.nan)}, {}, {})
    curvature = Curvature(np.arange(3), np.ones(3), np.full(3, 0.01))
    assumptions = (Assumption("one", "", holds=False), Assumption("other", "", holds=True))
    one = CLAIMS["C8"].judge(Observations(assumptions=assumptions))
    figure = figures.theorem(assumptions, one, records, curvature)
    bars = [patch.get_height() for patch in figure.axes[0].patches][: figures.LAGS]
    np.testing.assert_allclose(bars[:5], [0.8, 0.6, 0.4, 0.2, 0.0], atol=0.1)
    assert title(figure) == (
        "C8 the guarantee does not apply: 1 of 2 assumptions of two theorems do not hold for what"
        " is run"
    )
    np.testing.assert_allclose(figure.axes[1].get_lines()[0].get_ydata(), 0.01)
