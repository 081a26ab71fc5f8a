"""Values of the next state: by a second solve, and by a network that imitates the NMPC."""

from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.learning import Imitation, QNetwork, SecondSolve
from nmpcrl.learning.network import Target

THETA, OTHER = np.array([1.0, 0.5, -1.0]), np.array([2.0, 2.0, 2.0])
NEXT = [0.5, 0.0, -1.0, 0.3, 0.4]  # of `transition`: the next state, and the plan's second input


def answers(imitate, step, count):
    return [imitate(step, THETA) for _ in range(count)]


def values(imitate, step, count):
    return [one and one.value for one in answers(imitate, step, count)]


def test_the_second_solve_values_the_next_state_from_the_first_solution(controller, transition):
    step = transition(THETA)
    successor = SecondSolve(controller)(step, OTHER)
    ((state, theta, warm_start, action),) = controller.calls
    assert (state is step.next_state, theta is OTHER, action) == (True, True, None)
    assert warm_start is step.solution
    assert successor.value == OTHER @ step.next_state
    np.testing.assert_array_equal(successor.features, step.next_state)
    np.testing.assert_array_equal(successor.solution.state, step.next_state)
    assert (np.isnan(successor.loss), successor.seconds) == (True, 0)


@pytest.mark.parametrize("with_theta", [True, False])
def test_the_network_learns_the_value_that_was_solved_and_is_asked_for_the_next(
    network, transition, with_theta
):
    """The action applied, noise included, and the theta of the solution; then the present one."""
    network.batch = 1
    successor = Imitation(network, with_theta=with_theta)(transition(THETA), OTHER)
    ((inputs, target),), (asked,) = network.remembered, network.asked
    np.testing.assert_array_equal(inputs, [1.0, 2.0, 3.0, -0.6, 1.0, *THETA[: 3 * with_theta]])
    assert target == 1.0 + 1.0 - 3.0
    np.testing.assert_array_equal(asked, [*NEXT, *OTHER[: 3 * with_theta]])
    assert (successor.value, successor.features, successor.solution) == (7.0, None, None)


@pytest.mark.parametrize("fits", [1, 4])
def test_gated_waits_for_the_first_fit_and_literally_an_untrained_network_is_asked(
    network, transition, fits
):
    literal, step = replace(network, remembered=[], asked=[]), transition(THETA)
    gated = answers(Imitation(network, with_theta=True, fits=fits), step, 5)
    assert gated[:2] == [None, None]
    losses = [0.25 * fits * k for k in (1, 2, 3)]  # of the last fit in a step
    assert [one.loss for one in gated[2:]] == losses
    found = answers(Imitation(literal, with_theta=True, gated=False, fits=fits), step, 5)
    np.testing.assert_array_equal([one.loss for one in found], [np.nan, np.nan, *losses])
    assert [one.value for one in found] == [7.0] * 5
    for one in (network, literal):
        assert (one.fits, len(one.remembered)) == (3 * fits, 5)


@pytest.mark.parametrize("gated", [True, False])
def test_the_state_in_which_an_episode_ended_is_worth_nothing(network, transition, gated):
    network.batch = 1
    ended = replace(transition(THETA), end=True)
    assert Imitation(network, with_theta=True, gated=gated)(ended, THETA).value == 0
    assert len(network.remembered) == network.fits == 1


@pytest.mark.parametrize(
    ("options", "waits", "order"),
    [
        ({}, 2, ["fit", "predict"] * 3),  # Eq. (11) comes after Eq. (10) in Algorithm 1
        ({"gated": False}, 0, ["predict"] * 2 + ["fit", "predict"] * 3),
        ({"late": True}, 3, ["fit", "predict", "fit", "predict", "fit"]),
        ({"gated": False, "late": True}, 0, ["predict"] * 2 + ["predict", "fit"] * 3),
    ],
)
def test_the_network_fits_before_it_is_asked_and_a_late_one_after(
    network, transition, options, waits, order
):
    found, fit, predict = [], network.fit, network.predict
    network.fit = lambda: (found.append("fit"), fit())[1]
    network.predict = lambda inputs: (found.append("predict"), predict(inputs))[1]
    imitate = Imitation(network, with_theta=False, **options)
    assert values(imitate, transition(THETA), 5) == [None] * waits + [7.0] * (5 - waits)
    assert found == order


def taught():
    """A network that is ready with its first example, of state and action."""
    return QNetwork(5, np.random.default_rng(0), batch=1)


def test_a_lagged_copy_is_refreshed_after_some_steps_and_an_averaged_one_goes_a_part_each(
    transition,
):
    network, found, present = taught(), [], []
    lagged = Imitation(network, with_theta=False, target=Target(network, every=3))
    for _ in range(8):
        found += values(lagged, transition(THETA), 1)
        present.append(float(network.predict(np.array(NEXT))))
    assert found == [None, None, *[present[2]] * 3, *[present[5]] * 3]
    network = taught()
    target, average = Target(network, rate=0.1), network.weights.copy()
    averaged = Imitation(network, with_theta=False, target=target)
    for _ in range(5):
        averaged(transition(THETA), THETA)
        average += 0.1 * (network.weights - average)
        np.testing.assert_allclose(target.weights, average, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("with_theta", [True, False])
def test_greedily_the_next_action_is_the_one_of_the_least_value(network, transition, with_theta):
    network.batch, best = 1, np.array([0.25, -0.4])

    def predict(inputs):
        network.asked.append(inputs)
        return ((inputs[..., 3:5] - best) ** 2).sum(axis=-1)

    network.predict = predict
    actions = np.array([0.0, -1.0]), np.array([0.6, 1.0])
    imitate = Imitation(network, with_theta=with_theta, actions=actions)
    successor = imitate(transition(THETA), OTHER)
    np.testing.assert_allclose(network.asked[-1][3:5], best, atol=0.02)
    for asked in network.asked:
        assert (asked[..., :3] == NEXT[:3]).all()
        assert not with_theta or (asked[..., 5:] == OTHER).all()
    assert successor.value == pytest.approx(0, abs=1e-3)
