"""Figures of chapters 1 and 2, drawn from small inputs and read back."""

import numpy as np
import pytest

from nmpcrl.learning.rollout import Rollout, evaluate
from nmpcrl.report.figures.controller import plans as draw
from nmpcrl.report.figures.controller import sensitivity
from nmpcrl.report.figures.learners import expected_sarsa
from nmpcrl.study import Records, Runs, paper, sweep

LEARNERS, DECAYS, EPISODES, STEPS = ("ES", "frozen"), ("step", "episode"), 4, 5


@pytest.fixture(scope="module")
def nmpc():
    return paper.nmpc()


@pytest.fixture(scope="module")
def theta():
    return np.array(paper.THETA_INIT)


@pytest.fixture(scope="module")
def rollout(nmpc, theta):
    return evaluate(nmpc, theta, steps=5)


def straight(y: float, cost: float = 1.0) -> Rollout:
    x = np.linspace(-2.5, 8.5, 12)
    states = np.column_stack([x, np.full(12, y), np.zeros(12)])
    return Rollout(states, np.zeros((12, 2)), np.full(12, cost))


def records(experiment, slope: float) -> Records:
    """A run whose theta_x and noise-free cost move by `slope` an episode."""
    time = np.tile(np.arange(STEPS), EPISODES)
    episode = np.repeat(np.arange(EPISODES), STEPS)
    theta = np.tile(np.array(paper.THETA_INIT), (EPISODES * STEPS, 1))
    theta[:, 0] += slope * (episode + 1)
    steps = {
        "episode": episode,
        "time": time,
        "cost": 10.0 - 2.0 * episode,
        "status": np.zeros_like(time),
        "theta": theta,
        "alpha_phi2": 0.3 + slope * episode,
    }
    evaluations = {"episode": np.array([0, 4]), "cost": np.array([100.0, 100.0 - slope])}
    fields = {"episodes": EPISODES, "steps": STEPS, "theta": list(paper.THETA_INIT)}
    return Records(fields, steps, evaluations, {})


def study(slope: float = 0.1) -> Runs:
    runs = sweep(learner=LEARNERS, decay=DECAYS, seed=[0, 1], episodes=EPISODES)
    return Runs({run: records(run, slope * (run.learner == "ES")) for run in runs})


def test_the_closed_loop_is_drawn_with_its_plans_and_its_length(
    nmpc, theta, rollout, assert_readable, texts
):
    plan = nmpc.solve(nmpc.task.start, theta)
    figure = draw.closed_loop(nmpc.task, rollout, [plan])
    assert_readable(figure)
    assert "at most 1.2 m make a trajectory of 0.5 m" in texts(figure)


def test_the_plan_that_ends_farthest_from_the_closed_loop_is_drawn_and_named(
    theta, assert_readable, texts
):
    nmpc = paper.nmpc(horizon=4)
    loop = evaluate(nmpc, theta, steps=20)
    plans = [nmpc.solve(state, theta) for state in loop.states[:-4]]
    ends = np.array([plan.states[-1, :2] for plan in plans])
    apart = np.linalg.norm(ends - loop.states[4:, :2], axis=1)
    figure = draw.receding_horizon(nmpc.task, loop, plans)
    assert_readable(figure)
    assert f"The end of a plan is up to {apart.max():.2f} m from" in texts(figure)
    drawn = [line.get_xydata() for line in figure.axes[0].lines]
    assert any(np.array_equal(line, plans[apart.argmax()].states[:, :2]) for line in drawn)


@pytest.mark.parametrize(("lowest", "says"), [(10.0, "no lower elsewhere"), (9.0, "falls below")])
def test_the_title_says_whether_q_stays_above_v(lowest, says, assert_readable, texts):
    speeds, turn_rates = np.array([0.0, 0.6]), np.linspace(-1, 1, 3)
    values = np.array([[12.0, 11.0], [12.0, lowest], [12.0, 11.0]])
    policy = np.array([0.6, 0.0])
    figure = draw.action_values(speeds, turn_rates, values, 10.0, policy)
    assert_readable(figure)
    assert says in texts(figure)


def test_nine_panels_name_the_two_parameters_that_bend_the_trajectory_most(
    nmpc, assert_readable, texts
):
    changes = {name: {"×¼": straight(1.5), "×4": straight(1.6)} for name in paper.THETA_NAMES}
    changes["c"] = {"−0.2": straight(1.5), "0.35": straight(3.0, cost=np.inf)}
    changes["nu"] = {"×¼": straight(0.5), "×4": straight(1.5)}
    figure = draw.theta_effects(nmpc.task, straight(1.5), changes)
    assert_readable(figure)
    assert sum(axes.get_visible() for axes in figure.axes) == 9
    assert texts(figure).startswith(r"$\theta_c$ and $\theta_\nu$ (turn rate) bend")
    assert "0.35: fails" in [text.get_text() for text in figure.axes[8].texts]


def test_the_printed_box_says_how_near_the_robot_comes(nmpc, assert_readable, texts):
    stopped = straight(2.0)
    stopped.states[:, 0] = np.minimum(stopped.states[:, 0], 3.0)
    figure = draw.printed_box(nmpc.task, straight(2.0), stopped, wall=3.0)
    assert_readable(figure)
    assert "no nearer than 5.5 m" in texts(figure)


def test_the_penalty_figure_names_the_best_theta_c_and_leaves_failures_out(
    nmpc, assert_readable, texts
):
    theta_c, costs = np.array([0.001, 0.35, 0.5]), np.array([3.0, 1.0, np.inf])
    figure = draw.penalty_gap(nmpc.task, theta_c, costs)
    assert_readable(figure)
    assert "= 0.35 has the lowest cost" in texts(figure)
    assert np.isnan(figure.axes[1].lines[0].get_ydata()[-1])
    legend = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert legend == ["the NMPC keeps 1.251 m", "the penalty begins at 1.452 m"]


def test_the_one_variable_problem_and_its_tangent(assert_readable):
    theta = np.linspace(-1, 2, 7)
    figure = sensitivity.one_variable(theta, np.maximum(0, 1 - theta) ** 2, at=0.0, slope=-2.0)
    assert_readable(figure)
    tangent = figure.axes[0].lines[1]
    assert np.diff(tangent.get_ydata()) / np.diff(tangent.get_xdata()) == pytest.approx(-2)


def test_the_differences_figure_names_the_best_step(assert_readable, texts):
    steps = np.array([1e-6, 1e-4, 1e-2])
    figure = sensitivity.gradient_errors(steps, 10 * steps, np.array([1e-7, 1e-9, 1e-5]))
    assert_readable(figure)
    assert "to 1e-09, if the step is near 1e-04" in texts(figure)


def test_the_kink_figure_names_the_jump(assert_readable, texts):
    offsets = np.linspace(-0.01, 0.01, 5)
    values = np.where(offsets > 0, 120 * offsets, 20 * offsets)
    figure = sensitivity.kink(offsets, values, edge=0.001, slopes=(20.0, 120.0))
    assert_readable(figure)
    assert "jumps by 100.0" in texts(figure)


def test_the_share_figure_names_the_share_of_the_update_in_the_text(assert_readable, texts):
    pulls = np.linspace(0.1, 3, 30)
    figure = sensitivity.shares_closed(pulls, 2 * pulls, taken=0.4)
    assert_readable(figure)
    assert "With α‖φ‖² = 0.40 an update closes 0.80" in texts(figure)


def test_theta_paths_name_the_component_that_moves_most(assert_readable, texts):
    figure = expected_sarsa.theta_paths(study().select(learner="ES"))
    assert_readable(figure)
    assert r"$\theta_x$ moves most, by up to 0.4" in texts(figure)


@pytest.mark.parametrize(("slope", "says"), [(0.1, "stays below 2"), (1.0, "passes 2")])
def test_the_overshoot_figure_says_whether_2_was_passed(slope, says, assert_readable, texts):
    figure = expected_sarsa.overshoot(study(slope).select(learner="ES"))
    assert_readable(figure)
    assert says in texts(figure)


def test_the_frozen_arm_is_drawn_beside_the_learner_in_both_rows(assert_readable, texts):
    figure = expected_sarsa.two_costs(study())
    assert_readable(figure)
    assert "falls by up to 60% by itself" in texts(figure)
    assert [len(axes.lines) for axes in figure.axes] == [4, 4, 4, 4]


def test_the_fall_of_the_frozen_arm_is_a_share_of_its_first_cost():
    assert expected_sarsa.frozen_fall(study()) == pytest.approx(0.6)


def test_one_seed_and_one_decay_are_enough_for_every_figure_of_a_study(assert_readable):
    runs = sweep(learner=LEARNERS, decay="step", seed=3, episodes=EPISODES)
    small = Runs({run: records(run, 0.0) for run in runs})
    for figure in (expected_sarsa.theta_paths, expected_sarsa.overshoot, expected_sarsa.two_costs):
        assert_readable(figure(small))
