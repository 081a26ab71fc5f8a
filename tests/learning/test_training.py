"""Algorithm 1 as a generator, what a failed solve means, and the rollout without noise."""

import dataclasses
import re
from itertools import pairwise

import numpy as np
import pytest

from nmpcrl.control import Nmpc, SolverError, differential_drive
from nmpcrl.learning import UpdateRule, Weights, expected_sarsa, frozen, q_learning
from nmpcrl.learning.learners import Auxiliary, first_w
from nmpcrl.learning.rollout import evaluate
from nmpcrl.learning.training import (
    PATIENCE,
    Diverged,
    Exploration,
    count_episodes,
    count_steps,
    train,
)
from nmpcrl.study import Experiment, paper
from nmpcrl.study.learners import DECAYS
from nmpcrl.study.setup import prepare

THETA = np.array(paper.THETA_INIT)


class Faulty(Nmpc):
    """The paper's controller, whose solves fail where `fails(number of the call)` says so."""

    def __init__(self, fails):
        super().__init__(differential_drive(), paper.task())
        self.fails = fails
        self.warm_starts = []  # of every call

    def solve(self, state, theta, warm_start=None, action=None):
        self.warm_starts.append(warm_start)
        if self.fails(len(self.warm_starts) - 1):
            raise SolverError(f"call {len(self.warm_starts) - 1} failed", state, theta)
        return super().solve(state, theta, warm_start, action)


@pytest.fixture(scope="module")
def sound() -> Nmpc:
    return paper.nmpc()


def first_weights():
    return Weights(THETA.copy(), np.full(9, paper.W_INIT))


def quiet(episodes, steps):
    """No exploration at all."""
    return Exploration(np.zeros((episodes, steps, 2)), np.ones((episodes, steps)))


def noisy(episodes, steps, scale=1.0):
    noise = np.random.default_rng(0).normal(size=(episodes, steps, 2))
    return Exploration(noise, np.full((episodes, steps), scale))


def training(controller, explore, make=frozen):
    return list(train(make(controller), controller, first_weights(), explore))


def es(controller):
    return expected_sarsa(controller, paper.ALPHA)


def places(steps):
    return [(step.episode, step.time) for step in steps]


def test_steps_come_in_order_and_every_episode_begins_at_the_start(sound):
    steps = training(sound, noisy(3, 4))
    assert places(steps) == [(e, t) for e in range(3) for t in range(4)]
    for step in steps:
        assert np.array_equal(step.state, sound.task.start) == (step.time == 0)


def test_a_step_is_the_plants_and_costs_what_the_task_says(sound):
    plant, task = sound.plant, sound.task
    steps = training(sound, noisy(1, 6), es)
    for now, later in pairwise(steps):
        np.testing.assert_array_equal(plant.step(now.state, now.action), later.state)
    for step in steps:
        assert step.cost == task.stage_cost(step.state, step.action)


def test_the_action_is_the_policys_with_noise_and_clipped(sound):
    explore, plant = noisy(2, 5, scale=0.7), sound.plant
    clipped = 0
    for step in training(sound, explore):
        wish = step.solution.action + 0.7 * explore.noise[step.episode, step.time]
        np.testing.assert_allclose(step.action, np.clip(wish, plant.lower, plant.upper))
        clipped += not np.array_equal(step.action, wish)
    assert clipped > 0


def test_an_action_that_is_not_clipped_is_the_wish(sound):
    explore = noisy(1, 8)
    steps = list(train(frozen(sound), sound, first_weights(), explore, clipped=False))
    for step in steps:
        wish = step.solution.action + explore.noise[step.episode, step.time]
        np.testing.assert_array_equal(step.action, wish)
    assert any((np.abs(step.action) > sound.plant.upper).any() for step in steps)


def test_where_actions_are_valued_the_solution_has_the_applied_action_first(sound):
    weights = first_weights()
    steps = train(es(sound), sound, weights, noisy(2, 5), constrained=True)
    for step in steps:
        np.testing.assert_allclose(step.solution.action, step.action, atol=1e-12)
        afresh = sound.solve(step.state, weights.theta, None, step.action)
        assert step.solution.value == pytest.approx(afresh.value, rel=1e-6)
        assert step.solution.value >= step.plan.value - 1e-6
        free = sound.solve(step.state, weights.theta)
        assert step.plan.value == pytest.approx(free.value, rel=1e-6)
        weights = step.weights


def test_where_states_are_valued_the_solution_is_the_plan(sound):
    assert all(step.solution is step.plan for step in training(sound, noisy(1, 5), es))


def test_a_learner_of_action_values_gets_them_unless_told_otherwise(sound):
    learner = q_learning(sound, paper.ALPHA)
    for told, valued in (({}, True), ({"constrained": False}, False)):
        for step in train(learner, sound, first_weights(), noisy(1, 3), **told):
            assert (step.solution is not step.plan) == valued


@pytest.mark.parametrize(
    ("noise", "scale"), [((2, 5), (2, 5)), ((2, 5, 2), (2,)), ((2, 5, 2), (2, 4))]
)
def test_noise_of_another_shape_is_refused_with_it(noise, scale):
    with pytest.raises(ValueError, match=rf"{re.escape(str(noise))}.* \(episodes, steps, inputs\)"):
        Exploration(np.zeros(noise), np.ones(scale))


def test_noise_for_another_number_of_inputs_is_refused(sound):
    explore = Exploration(np.zeros((1, 3, 1)), np.ones((1, 3)))
    with pytest.raises(ValueError, match="1 numbers a step; the NMPC has 2 inputs"):
        next(train(frozen(sound), sound, first_weights(), explore))


@pytest.mark.parametrize(
    ("given", "options", "message"),
    [
        (THETA, {}, r"weights = array.* must be Weights: write Weights\(theta\)"),
        (None, {"clipped": False}, r"clipped = False .* \[0.6    1.5708\].* QL has no Q\(s, a\)"),
        (None, {"controller": 5}, "controller = 5 must be an Nmpc"),
    ],
)
def test_what_cannot_be_trained_is_refused_at_the_call(sound, given, options, message):
    given = first_weights() if given is None else given
    what = {"learner": q_learning(sound, 1e-7), "controller": sound} | options
    with pytest.raises(ValueError, match=message):
        train(weights=given, explore=noisy(1, 3), **what)


def test_weights_may_be_lists_and_are_left_as_they_are(sound):
    def in_place(theta, memory, *_):
        theta[:] += 1.0
        return theta, memory

    given = Weights(THETA.tolist(), [0.0] * 9)
    learner = dataclasses.replace(es(sound), rule=UpdateRule(in_place))
    *_, last = train(learner, sound, given, noisy(1, 3))
    np.testing.assert_array_equal(last.weights.theta, THETA + 3)
    assert given.theta == THETA.tolist()


def test_weights_go_from_step_to_step_and_from_episode_to_episode(sound):
    weights = first_weights()
    for step in training(sound, noisy(2, 4), es):
        np.testing.assert_array_equal(step.solution.theta, weights.theta)
        moved = weights.theta + paper.ALPHA * step.update.delta * step.solution.features
        np.testing.assert_allclose(step.weights.theta, moved, rtol=1e-14)
        weights = step.weights
    assert not np.array_equal(weights.theta, THETA)


def test_frozen_weights_never_move(sound):
    for step in training(sound, noisy(2, 4)):
        np.testing.assert_array_equal(step.weights.theta, THETA)


def test_training_can_be_stopped_at_any_step(sound):
    steps = train(frozen(sound), sound, first_weights(), noisy(1000, 130))
    assert places([next(steps), next(steps)]) == [(0, 0), (0, 1)]
    steps.close()


def test_the_second_solve_is_the_next_first_ones_warm_start():
    """It was solved in that very state, so nothing is shifted, and little is left to do."""
    controller = Faulty(lambda call: False)
    steps = training(controller, noisy(1, 4), es)
    warm_starts = controller.warm_starts
    assert warm_starts[0] is None
    for k, step in enumerate(steps):
        assert warm_starts[2 * k + 1] is step.solution
        if k + 1 < len(steps):
            assert warm_starts[2 * k + 2] is step.update.successor.solution


def test_without_a_second_solve_the_plan_itself_is_the_next_warm_start():
    controller = Faulty(lambda call: False)
    steps = training(controller, noisy(2, 3))
    plans = [step.solution for step in steps]
    assert controller.warm_starts == [None, *plans[:2], None, *plans[3:5]]


def test_the_step_reading_counts_time_through_training():
    np.testing.assert_array_equal(count_steps(3, 4), [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]])


def test_the_episode_reading_counts_episodes():
    np.testing.assert_array_equal(count_episodes(3, 4), [[0] * 4, [1] * 4, [2] * 4])


@pytest.mark.parametrize("decay", list(DECAYS))
def test_exploration_shrinks_by_the_rate_each_count(sound, decay):
    experiment = Experiment(decay=decay, episodes=3, steps=4, decay_rate=0.5)
    scale = prepare(experiment, sound)[2].scale
    by_hand = [
        [0.5 ** {"step": 4 * e + t, "episode": e}[decay] for t in range(4)] for e in range(3)
    ]
    np.testing.assert_allclose(scale, by_hand)


def test_noise_is_standard_normal(sound):
    noise = prepare(Experiment(episodes=200, steps=130), sound)[2].noise
    assert noise.shape == (200, 130, 2)
    assert noise.mean() == pytest.approx(0, abs=0.02)
    assert noise.std() == pytest.approx(1, abs=0.02)


def test_a_solve_that_fails_ends_the_episode_and_learning_goes_on():
    controller = Faulty(lambda call: call == 2)
    steps = training(controller, quiet(2, 4))
    assert places(steps) == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (1, 3)]
    failed = steps[2]
    assert "call 2 failed" in failed.failure
    assert failed.solution is None
    assert failed.update is None
    assert np.isnan(failed.action).all()
    assert np.isnan(failed.cost)
    np.testing.assert_array_equal(steps[3].state, controller.task.start)
    assert [bool(step.failure) for step in steps] == [False, False, True] + [False] * 4


def test_a_second_solve_that_fails_ends_the_episode_and_keeps_theta():
    # the calls are V(s0), V(s1), V(s1), V(s2), which fails
    controller = Faulty(lambda call: call == 3)
    steps = training(controller, quiet(2, 3), es)
    assert places(steps) == [(0, 0), (0, 1), (1, 0), (1, 1), (1, 2)]
    failed = steps[1]
    assert failed.failure
    assert failed.solution is not None
    assert failed.update is None
    assert np.isfinite(failed.cost)
    np.testing.assert_array_equal(failed.weights.theta, steps[0].weights.theta)
    np.testing.assert_array_equal(steps[2].solution.theta, steps[0].weights.theta)


@pytest.mark.parametrize("failing", [2, 3])  # a plan, or the solve after it
def test_the_learner_is_told_of_a_failed_episode_and_of_each_first_step(failing):
    told = []

    def step(theta, memory, transition, delta, successor):
        told.append(transition.first)
        return theta, memory

    rule = UpdateRule(step, interrupted=lambda theta, memory: (1.01 * theta, memory))

    controller = Faulty(lambda call: call == failing)
    steps = training(controller, quiet(2, 3), lambda c: dataclasses.replace(es(c), rule=rule))
    assert told == [True, True, False, False]
    failed = next(k for k, step in enumerate(steps) if step.failure)
    for step in steps[failed:]:
        np.testing.assert_array_equal(step.weights.theta, 1.01 * THETA)


def test_ten_failed_episodes_in_a_row_are_a_divergence():
    controller = Faulty(lambda call: True)
    steps = []
    with pytest.raises(Diverged, match="10 episodes in a row ended in a failed solve: call 9 fail"):
        steps.extend(train(frozen(controller), controller, first_weights(), quiet(30, 4)))
    assert places(steps) == [(e, 0) for e in range(PATIENCE)]


def test_ten_failed_episodes_not_in_a_row_are_none():
    """Nine fail at once, the tenth goes through, and nine more fail."""
    fails = [True] * 9 + [False] * 2 + [True] * 9
    controller = Faulty(lambda call: fails[call])
    steps = training(controller, quiet(19, 2))
    assert places(steps)[-1] == (18, 0)


def leap(spoil):
    """A learner that spoils theta and w in its third step."""
    count = 0

    def step(theta, memory, *_):
        nonlocal count
        count += 1
        return spoil(theta, memory) if count == 3 else (theta, memory)

    return lambda controller: dataclasses.replace(es(controller), rule=UpdateRule(step, first_w))


@pytest.mark.parametrize("absurd", [np.nan, np.inf, -1e7])
@pytest.mark.parametrize("name", ["theta", "w"])
def test_weights_that_are_not_numbers_or_absurd_are_a_divergence(sound, name, absurd):
    def spoil(theta, memory):
        spoiled = {"theta": theta.copy(), "w": memory.w.copy()}
        spoiled[name][4] = absurd
        return spoiled["theta"], Auxiliary(spoiled["w"])

    steps = []
    with pytest.raises(Diverged, match=rf"(?s)^{name} .*left the numbers"):
        steps.extend(train(leap(spoil)(sound), sound, first_weights(), quiet(2, 5)))
    assert places(steps) == [(0, 0), (0, 1), (0, 2)]
    assert not np.abs(getattr(steps[-1].weights, name)[4]) <= 1e6  # the step itself is kept


@pytest.fixture(scope="module")
def rollout(sound):
    return evaluate(sound, THETA, paper.STEPS)


def test_the_noise_free_cost_of_theta_init_is_the_reference(rollout):
    """DESIGN's number, from independent code: 4695 over t = 0, ..., 129, not discounted."""
    assert rollout.cost == pytest.approx(4695, abs=1)


def test_with_theta_c_at_the_penaltys_margin_the_cost_is_the_other_reference(sound):
    assert evaluate(sound, np.append(THETA[:-1], 0.35), paper.STEPS).cost == pytest.approx(
        4119, abs=1
    )


def test_ipopt_reaches_the_same_cost(rollout):
    controller = paper.nmpc(solver="ipopt")
    assert evaluate(controller, THETA, paper.STEPS).cost == pytest.approx(rollout.cost, rel=1e-4)


def test_a_rollout_follows_the_plant_and_adds_up_its_costs(sound, rollout):
    plant, task = sound.plant, sound.task
    assert rollout.states.shape == (130, 3)
    assert rollout.actions.shape == (130, 2)
    np.testing.assert_array_equal(rollout.states[0], task.start)
    for now, action, later in zip(
        rollout.states[:-1], rollout.actions[:-1], rollout.states[1:], strict=True
    ):
        np.testing.assert_array_equal(plant.step(now, action), later)
    by_hand = [task.stage_cost(s, a) for s, a in zip(rollout.states, rollout.actions, strict=True)]
    assert rollout.cost == pytest.approx(sum(by_hand), rel=1e-14)


def test_the_rollout_of_theta_init_reaches_the_target_and_hits_nothing(sound, rollout):
    task = sound.task
    assert task.distance(rollout.states[-1]) < 0.1
    assert (task.overlap(rollout.states) <= 1e-6).all()
    assert (np.abs(rollout.actions) <= sound.plant.upper).all()
    assert (task.lower <= rollout.states).all()
    assert (rollout.states <= task.upper).all()


def test_a_rollout_that_fails_costs_infinity_and_keeps_what_it_had():
    controller = Faulty(lambda call: call >= 3)
    failed = evaluate(controller, THETA, 10)
    assert failed.cost == np.inf
    assert failed.states.shape == (3, 3)
    assert failed.actions.shape == (3, 2)
    assert "failed" in failed.failure


@pytest.mark.parametrize("plant", [None, lambda x, u, rng: (x[:2], float(u @ u), False)])
def test_a_rollout_needs_no_more_than_a_solve(sound, plant):
    class Lower:
        """The lower of two solves; what it holds says where, or plant and start do."""

        def __init__(self, nmpc):
            self.solve = lambda state, theta, plan: min(
                nmpc.solve([*state, 0.0][:3], theta, plan), nmpc.solve([*state, 0.0][:3], theta),
                key=lambda one: one.value,
            )  # fmt: skip
            self.inner = nmpc if plant is None else None

    start = None if plant is None else [0.5, 0.2]
    ran = evaluate(Lower(sound), THETA, 4, plant=plant, start=start)
    assert ran.states.shape == (4, 3 if plant is None else 2)
    if plant is None:
        assert ran.cost == pytest.approx(evaluate(sound, THETA, 4).cost, rel=1e-6)
        steps = train(frozen(sound), Lower(sound), first_weights(), quiet(1, 4))
        np.testing.assert_array_equal([step.state for step in steps], ran.states)
    else:
        with pytest.raises(ValueError, match=r"give plant=.* and start="):
            evaluate(Lower(sound), THETA, 4)


def test_a_rollout_that_fails_at_once_has_no_steps():
    controller = Faulty(lambda call: True)
    failed = evaluate(controller, THETA, 10)
    assert failed.states.shape == (0, 3)
    assert failed.actions.shape == (0, 2)
    assert failed.cost == np.inf
