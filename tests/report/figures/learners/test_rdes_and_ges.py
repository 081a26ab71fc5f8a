"""The figures of chapters 3 and 4, and what they compute from records."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from nmpcrl.analysis import metrics
from nmpcrl.analysis.extrapolation import Outcome
from nmpcrl.analysis.gradient_td import directions, dropped_curvature
from nmpcrl.analysis.imitation import imitate
from nmpcrl.analysis.two_state import Chain
from nmpcrl.report.figures.learners import ges, rdes
from nmpcrl.study import Experiment, Runs, paper, run, sweep

SMALL = {"episodes": 4, "steps": 45, "evaluate_every": 2}


@pytest.fixture(scope="module")
def study():
    """All five learners, both readings of the decay, four short episodes."""
    learners = ("ES", "DES", "RDES", "GES", "frozen")
    experiments = sweep(learner=learners, decay=("step", "episode"), **SMALL)
    return Runs({experiment: run(experiment) for experiment in experiments})


def one(study, learner, decay="step"):
    (records,) = study.select(learner=learner, decay=decay).values()
    return records


def heading(figure: Figure) -> str:
    return figure.get_suptitle() or figure.axes[0].get_title(loc="left")


def test_the_correction_of_ges_is_gamma_times_w_phi_times_the_next_features(study):
    """Against a second solve in the next state, at steps where the features are smooth."""
    records = one(study, "GES")
    parts, before = directions(records), metrics.theta_before(records)
    nmpc, steps = paper.nmpc(), records.steps
    for k in (10, 20, 30):
        solution = nmpc.solve(steps["state"][k], before[k])
        after = nmpc.solve(steps["state"][k + 1], before[k], solution)
        expected = paper.GAMMA * parts.predicted[k] * after.features
        np.testing.assert_allclose(parts.correction[k], expected, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (rdes.online_errors, "the next value is off by"),
        (ges.overshoots, "In the median run, no step of ES or GES is above 2"),
        (ges.corrections, "times as long as δφ"),
    ],
)
def test_a_figure_of_the_study_says_what_it_found(study, draw, words):
    figure = draw(study)
    assert words in heading(figure)
    for axes in figure.axes:
        assert axes.get_xlabel() or axes.get_shared_x_axes().get_siblings(axes)
    assert any("[" in axes.get_ylabel() for axes in figure.axes)


def test_a_run_that_was_stopped_early_can_be_drawn(study):
    full = one(study, "DES")
    steps = {name: column[:60].copy() for name, column in full.steps.items()}
    steps["status"][-1] = 2
    for name in ("value", "next_value", "delta", "features", "alpha_phi2"):
        steps[name][-1] = np.nan
    evaluations = {name: column[:1] for name, column in full.evaluations.items()}
    stopped = type(full)(full.experiment, steps, evaluations, {"stopped": "diverged"})
    runs = {e: stopped if r is full else r for e, r in study.items()}
    rdes.online_errors(Runs(runs))


def test_the_chain_s_figure_names_the_ratio_from_which_gradient_td_converges():
    figure = ges.on_the_chain(Chain(), 0.1, (0.1, 4.0), updates=50)
    assert heading(figure) == "Gradient TD converges once β is above 1.03 α"


def test_the_gate_s_figure_says_how_far_theta_x_fell():
    literal, gated = (run(Experiment("RDES", episodes=2, gated=g)) for g in (False, True))
    figure = rdes.literal_and_gated(literal, gated)
    lowest = literal.steps["theta"][: paper.BATCH - 1, 0].min()
    assert f"{lowest:.2f}" in heading(figure)


def test_the_networks_figure_counts_the_runs_that_theta_helped(study):
    imitations = [imitate(one(study, "ES", decay), fits=5) for decay in ("step", "episode")]
    helped = sum(i.ratio < 1 for i in imitations)
    assert f"in {helped} of 2 runs" in heading(rdes.held_out_errors(imitations))


def test_the_curvature_s_figure_gives_the_median(study):
    measured = dropped_curvature(one(study, "GES"), samples=10)
    assert f"{np.median(measured.ratio):.1%}" in heading(ges.curvatures((measured,)))


def test_a_run_that_was_stopped_ends_in_a_cross():
    def outcome(stopped: bool, count: int) -> Outcome:
        numbers = np.linspace(0.1, 1.0, count)
        overshoot = np.r_[0.0, numbers[1:-1], 1e6 if stopped else 1.5]
        return Outcome(stopped, count, numbers, overshoot, numbers)

    run = {
        "none": outcome(True, 8),
        "theta held": outcome(False, 12),
        "true slope": outcome(False, 12),
    }
    other = run | {"theta held": outcome(True, 10)}
    figure = rdes.interventions({"layout B": run, "layout D": other}, "")
    crosses = [
        [line.get_xdata().tolist() for line in axes.get_lines() if line.get_marker() == "X"]
        for axes in figure.axes[:2]
    ]
    assert crosses == [[[8]], [[8], [10]]]
    drawn = figure.axes[0].get_lines()[0].get_ydata()
    assert np.isnan(drawn[0])  # before the first fit
    assert drawn[-1] == rdes.SHOWN[1]
