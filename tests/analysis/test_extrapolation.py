"""Theta as the network's input: what its slope feeds back, and what an intervention changes."""

from types import SimpleNamespace

import numpy as np
import pytest

from nmpcrl.analysis.extrapolation import INTERVENTIONS, StartTheta, feedback, watch
from nmpcrl.learning.bootstrap import NextValue
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.run import run

SHORT = {"layout": "B", "seed": 1, "decay": "episode", "episodes": 2, "steps": 90}


class Linear:
    """A network that predicts 3 a'theta."""

    def __init__(self, a):
        self.network, self.a = self, np.asarray(a, float)

    def inputs(self, state, action, theta):
        return theta

    def predict(self, theta):
        return 3 * self.a @ theta

    def __call__(self, transition, theta):
        return NextValue(float(self.predict(theta)))


def transition(phi=(1.0, 2.0), last=False):
    solution = SimpleNamespace(features=np.asarray(phi), next_action=np.zeros(2))
    return SimpleNamespace(
        solution=solution, next_state=np.zeros(3), last=last, end=False, next_data=None
    )


@pytest.mark.parametrize("a", [(0.5, -0.1), (1 / 3, 2 / 3)])
def test_feedback_of_a_linear_network_is_gamma_times_its_slope_along_phi(a):
    phi = np.array([1.0, 2.0])
    expected = 0.9 * 3 * (a @ phi) / (phi @ phi)  # 0.9 where the slope is phi
    assert feedback(Linear(a), transition(phi), np.ones(2), 0.9) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("true_slope", "values"), [(False, [3, 3, 3, 12]), (True, [3, 3 + 40 - 10, 3 + 90 - 10, 12])]
)
def test_the_first_theta_of_an_episode_predicts_and_the_true_slope_is_the_change_of_v(
    true_slope, values
):
    controller = SimpleNamespace(
        solve=lambda state, theta, start: SimpleNamespace(value=10 * theta[0] ** 2)
    )
    bootstrap = StartTheta(Linear([1.0]), controller, true_slope)
    steps = ((1.0, False), (2.0, False), (3.0, True), (4.0, False))
    found = [bootstrap(transition(last=last), np.array([theta])).value for theta, last in steps]
    assert found == values


def test_a_run_without_an_intervention_is_the_studys_and_others_differ_once_a_network_is_fitted():
    """90 steps are fewer than a batch: theta waits until the second episode."""
    outcomes = {name: watch(Experiment("RDES", **SHORT), name) for name in INTERVENTIONS}
    assert all(np.isnan([one.delta[0], one.feedback[0]]).all() for one in outcomes.values())
    assert len({one.delta[1] for one in outcomes.values()}) == len(outcomes)
    steps = run(Experiment("RDES", **SHORT)).steps
    assert outcomes["none"].episodes == 2
    delta = steps["delta"][steps["episode"] == 1]
    assert outcomes["none"].delta[1] == pytest.approx(np.sqrt(np.nanmean(delta**2)))
    without_theta = watch(Experiment("DES", **SHORT)).feedback
    assert np.isnan(without_theta[0])
    assert without_theta[1] == 0
    with pytest.raises(TypeError, match="'ES' has no network"):
        watch(Experiment("ES", **SHORT))


@pytest.mark.slow
def test_with_the_true_slope_a_run_survives_that_is_stopped_without():
    experiment = Experiment("RDES", layout="D", seed=5, decay="episode", episodes=12)
    assert watch(experiment).stopped
    assert not watch(experiment, "true slope").stopped
