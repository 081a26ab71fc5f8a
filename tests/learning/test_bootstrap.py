"""Where the next value comes from: what is solved, remembered and asked of the network."""

from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.learning import Imitation, QNetwork, SecondSolve
from nmpcrl.learning.network import Target

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


@pytest.mark.parametrize("gated", [True, False])
def test_the_state_in_which_an_episode_ended_is_worth_nothing(network, transition, gated):
    network.batch = 1
    ended = replace(transition(THETA), end=True)
    assert Imitation(network, with_theta=True, gated=gated)(ended, THETA).value == 0
    assert len(network.remembered) == network.fits == 1


def test_the_network_fits_before_it_is_asked(network, transition):
    """Eq. (11) comes after Eq. (10) in Algorithm 1."""
    network.batch, order = 1, []
    fit, predict = network.fit, network.predict
    network.fit = lambda: (order.append("fit"), fit())[1]
    network.predict = lambda inputs: (order.append("predict"), predict(inputs))[1]
    Imitation(network, with_theta=False)(transition(THETA), THETA)
    assert order == ["fit", "predict"]


@pytest.mark.parametrize("gated", [True, False])
def test_a_late_network_is_asked_before_it_is_fitted(network, transition, gated):
    order = []
    fit, predict = network.fit, network.predict
    network.fit = lambda: (order.append("fit"), fit())[1]
    network.predict = lambda inputs: (order.append("predict"), predict(inputs))[1]
    imitate = Imitation(network, with_theta=False, gated=gated, late=True)
    answers = [imitate(transition(THETA), THETA) for _ in range(5)]
    if gated:  # the first fit is made in the third step, and known of in the fourth
        assert [answer is None for answer in answers] == [True, True, True, False, False]
        assert order == ["fit", "predict", "fit", "predict", "fit"]
    else:
        assert order == ["predict", "predict", *["predict", "fit"] * 3]


def test_a_late_network_predicts_what_it_did_after_the_step_before(transition):
    """The same examples and fits; each value is that of the weights one fit earlier."""
    imitate = {late: Imitation(taught(), with_theta=False, late=late) for late in (True, False)}
    step = transition(THETA)
    values = {late: [one(step, THETA) for _ in range(6)] for late, one in imitate.items()}
    assert values[True][0] is None
    late, prompt = ([one.value for one in values[key] if one] for key in (True, False))
    assert late == prompt[:-1]


def taught():
    """A network that is ready with its first example, of state and action."""
    return QNetwork(5, np.random.default_rng(0), batch=1)


def test_a_lagged_copy_predicts_and_is_refreshed_after_so_many_steps(transition):
    network = taught()
    lagged = Imitation(network, with_theta=False, target=Target(network, every=3))
    step, inputs = transition(THETA), np.array([0.5, 0.0, -1.0, 0.3, 0.4])
    values, present = [], []
    for _ in range(8):
        successor = lagged(step, THETA)
        values.append(successor and successor.value)
        present.append(float(network.predict(inputs)))
    assert values == [None, None, *[present[2]] * 3, *[present[5]] * 3]


def test_an_averaged_copy_goes_a_part_of_the_way_at_each_step(transition):
    network = taught()
    target, average = Target(network, rate=0.1), network.weights.copy()
    averaged, step = Imitation(network, with_theta=False, target=target), transition(THETA)
    for _ in range(5):
        averaged(step, THETA)
        average += 0.1 * (network.weights - average)
        np.testing.assert_allclose(target.weights, average, rtol=1e-5, atol=1e-7)


def test_a_copy_that_follows_at_once_changes_nothing(transition):
    one, other = taught(), taught()
    plain = Imitation(one, with_theta=False)
    copied = Imitation(other, with_theta=False, target=Target(other))
    step = transition(THETA)
    for _ in range(5):
        assert copied(step, THETA).value == plain(step, THETA).value


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
        assert (asked[..., :3] == [0.5, 0.0, -1.0]).all()
        assert not with_theta or (asked[..., 5:] == OTHER).all()
    assert successor.value == pytest.approx(0, abs=1e-3)
