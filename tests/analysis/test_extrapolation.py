"""Theta as the network's input: what its slope feeds back, and what an intervention changes."""

from types import SimpleNamespace

import numpy as np
import pytest

from nmpcrl.analysis.extrapolation import (
    INTERVENTIONS,
    Held,
    TrueSlope,
    feedback,
    watch,
)
from nmpcrl.learning.bootstrap import Successor
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.run import run

SHORT = {"layout": "B", "seed": 1, "decay": "episode", "episodes": 2, "steps": 90}


class Linear:
    """A network that predicts 3 a'theta, and remembers what it was asked with."""

    def __init__(self, a):
        self.network, self.a, self.asked = self, np.asarray(a, float), []

    def inputs(self, state, action, theta):
        return theta

    def predict(self, theta):
        self.asked.append(theta)
        return 3 * self.a @ theta

    def __call__(self, transition, theta):
        return Successor(float(self.predict(theta)))


def transition(phi=(1.0, 2.0), last=False):
    solution = SimpleNamespace(features=np.asarray(phi), next_action=np.zeros(2))
    return SimpleNamespace(
        solution=solution, next_state=np.zeros(3), last=last, end=False, next_data=None
    )


def test_feedback_of_a_linear_network_is_gamma_times_its_slope_along_phi():
    phi = np.array([1.0, 2.0])
    network = Linear([0.5, -0.1])
    expected = 0.9 * 3 * (network.a @ phi) / (phi @ phi)
    assert feedback(network, transition(phi), np.ones(2), 0.9) == pytest.approx(expected)


def test_a_network_whose_slope_is_phi_feeds_back_gamma():
    phi = np.array([1.0, 2.0])
    assert feedback(Linear(phi / 3), transition(phi), np.ones(2), 0.97) == pytest.approx(0.97)


def test_theta_is_held_until_the_episode_is_over():
    network = Linear([1.0])
    held = Held(network, None)
    for theta, last in ((1.0, False), (2.0, False), (3.0, True), (4.0, False)):
        held(transition(last=last), np.array([theta]))
    assert np.ravel(network.asked).tolist() == [1.0, 1.0, 1.0, 4.0]


def test_with_the_true_slope_the_prediction_moves_as_the_value_does():
    controller = SimpleNamespace(
        solve=lambda state, theta, start: SimpleNamespace(value=10 * theta[0] ** 2)
    )
    bootstrap = TrueSlope(Linear([1.0]), controller)
    first = bootstrap(transition(), np.array([1.0]))
    second = bootstrap(transition(), np.array([2.0]))
    assert first.value == 3.0
    assert second.value == 3.0 + 40.0 - 10.0


@pytest.fixture(scope="module")
def outcomes():
    return {name: watch(Experiment("RDES", **SHORT), name) for name in INTERVENTIONS}


def test_interventions_change_nothing_before_the_network_is_fitted(outcomes):
    # 90 steps are fewer than a batch: theta waits until the second episode
    first = [one.theta[0] for one in outcomes.values()]
    assert all(np.array_equal(one, first[0]) for one in first)
    assert len({one.theta[1].tobytes() for one in outcomes.values()}) == len(outcomes)


def test_the_untouched_run_is_that_of_the_study(outcomes):
    steps = run(Experiment("RDES", **SHORT)).steps
    assert np.array_equal(outcomes["none"].theta[-1], steps["theta"][-1])
    delta = steps["delta"][steps["episode"] == 1]
    assert outcomes["none"].delta[1] == pytest.approx(np.sqrt(np.nanmean(delta**2)))


def test_without_theta_as_an_input_nothing_is_fed_back():
    outcome = watch(Experiment("DES", **SHORT))
    assert np.isnan(outcome.feedback[0])
    assert outcome.feedback[1] == 0


def test_a_learner_without_a_network_is_refused():
    with pytest.raises(TypeError, match="'ES' has no network"):
        watch(Experiment("ES", **SHORT))


@pytest.mark.slow
def test_with_the_true_slope_a_run_survives_that_is_stopped_without():
    experiment = Experiment("RDES", layout="D", seed=0, decay="episode", episodes=12)
    assert watch(experiment).stopped
    assert not watch(experiment, "true slope").stopped
