"""Where the next value comes from: what is solved, remembered and asked of the network."""

import numpy as np
import pytest

from nmpcrl.learning import Imitation, SecondSolve

THETA = np.array([1.0, 0.5, -1.0])
OTHER = np.array([2.0, 2.0, 2.0])


def test_the_second_solve_values_the_next_state_under_the_given_theta(controller, transition):
    step = transition(THETA)
    successor = SecondSolve(controller)(step, OTHER)
    assert successor.value == OTHER @ step.next_state
    np.testing.assert_array_equal(successor.features, step.next_state)
    np.testing.assert_array_equal(successor.solution.state, step.next_state)


def test_the_second_solve_starts_from_the_first(controller, transition):
    step = transition(THETA)
    SecondSolve(controller)(step, THETA)
    ((state, theta, warm_start, action),) = controller.calls
    assert state is step.next_state
    assert theta is THETA
    assert warm_start is step.solution
    assert action is None


def test_a_second_solve_has_no_network_time(controller, transition):
    successor = SecondSolve(controller)(transition(THETA), THETA)
    assert np.isnan(successor.loss)
    assert successor.seconds == 0


@pytest.mark.parametrize("with_theta", [True, False])
def test_the_network_remembers_the_value_that_was_solved(network, transition, with_theta):
    """The target is V of the solution, whatever the cost and the next state were."""
    Imitation(network, with_theta=with_theta)(transition(THETA), THETA)
    ((_, target),) = network.remembered
    assert target == 1.0 + 1.0 - 3.0


def test_with_theta_the_network_sees_state_action_theta_in_this_order(network, transition):
    step = transition(THETA)
    Imitation(network, with_theta=True)(step, OTHER)
    ((inputs, _),) = network.remembered
    # the action applied, noise included; the theta of the solution, not the present one
    np.testing.assert_array_equal(inputs, [1.0, 2.0, 3.0, -0.6, 1.0, 1.0, 0.5, -1.0])


def test_without_theta_the_network_sees_state_and_action(network, transition):
    Imitation(network, with_theta=False)(transition(THETA), THETA)
    ((inputs, _),) = network.remembered
    np.testing.assert_array_equal(inputs, [1.0, 2.0, 3.0, -0.6, 1.0])


@pytest.mark.parametrize("with_theta", [True, False])
def test_the_network_is_asked_for_the_next_state_and_the_plans_second_input(
    network, transition, with_theta
):
    network.batch = 1
    successor = Imitation(network, with_theta=with_theta)(transition(THETA), OTHER)
    (asked,) = network.asked
    expected = [0.5, 0.0, -1.0, 0.3, 0.4] + [2.0, 2.0, 2.0] * with_theta
    np.testing.assert_array_equal(asked, expected)
    assert successor.value == 7.0
    assert successor.features is None
    assert successor.solution is None


def test_gated_waits_for_the_first_fit(network, transition):
    imitate = Imitation(network, with_theta=True)
    answers = [imitate(transition(THETA), THETA) for _ in range(5)]
    assert [answer is None for answer in answers] == [True, True, False, False, False]
    assert network.fits == 3
    assert len(network.remembered) == 5


def test_literally_the_untrained_network_is_asked_from_the_first_step(network, transition):
    imitate = Imitation(network, with_theta=True, gated=False)
    answers = [imitate(transition(THETA), THETA) for _ in range(5)]
    assert [answer.value for answer in answers] == [7.0] * 5
    assert network.fits == 3
    assert np.isnan(answers[1].loss)
    assert answers[2].loss == 0.25


@pytest.mark.parametrize("gated", [True, False])
def test_as_many_mini_batches_are_fitted_a_step_as_are_asked_for(network, transition, gated):
    imitate = Imitation(network, with_theta=True, gated=gated, fits=4)
    losses = [
        answer.loss for answer in (imitate(transition(THETA), THETA) for _ in range(5)) if answer
    ]
    assert network.fits == 3 * 4
    assert losses[-3:] == [0.25 * 4, 0.25 * 8, 0.25 * 12]  # of the last fit in the step


def test_the_network_fits_before_it_is_asked(network, transition):
    """Eq. (11) comes after Eq. (10) in Algorithm 1."""
    network.batch, order = 1, []
    fit, predict = network.fit, network.predict
    network.fit = lambda: (order.append("fit"), fit())[1]
    network.predict = lambda inputs: (order.append("predict"), predict(inputs))[1]
    Imitation(network, with_theta=False)(transition(THETA), THETA)
    assert order == ["fit", "predict"]
