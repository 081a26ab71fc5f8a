"""Algorithm 1 as a generator, failed solves, and the rollout without noise."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from learning.small_runs import THETA, noise, run

from nmpcrl.control import Nmpc, Problem, SolverError, differential_drive
from nmpcrl.learning import (
    UpdateRule,
    Weights,
    count_episodes,
    count_steps,
    expected_sarsa,
    frozen,
    q_learning,
)
from nmpcrl.learning.learners import Auxiliary, first_w
from nmpcrl.learning.rollout import evaluate
from nmpcrl.learning.training import Diverged, Exploration, train
from nmpcrl.study import paper


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


def es(controller):
    return expected_sarsa(controller, paper.ALPHA)


def places(steps):
    return [(step.episode, step.time) for step in steps]


def test_steps_are_those_of_algorithm_1_and_without_clipping_an_action_is_the_wish(robot):
    plant, task, weights, clipped = robot.plant, robot.task, Weights(THETA), 0
    explore = Exploration(noise(2, 5).noise, np.full((2, 5), 0.7))
    steps = run(es(robot), robot, explore)
    assert places(steps) == [(e, t) for e in range(2) for t in range(5)]
    for k, step in enumerate(steps):
        before = steps[k - 1]
        expected = plant.step(before.state, before.action) if step.time else task.start
        np.testing.assert_array_equal(step.state, expected)
        wish = step.plan.action + 0.7 * explore.noise[step.episode, step.time]
        np.testing.assert_allclose(step.action, np.clip(wish, plant.lower, plant.upper))
        clipped += not np.array_equal(step.action, wish)
        assert step.cost == task.stage_cost(step.state, step.action)
        assert step.solution is step.plan
        np.testing.assert_array_equal(step.solution.theta, weights.theta)
        moved = weights.theta + paper.ALPHA * step.update.delta * step.solution.features
        np.testing.assert_allclose(step.weights.theta, moved, rtol=1e-14)
        weights = step.weights
    assert clipped > 0
    assert not np.array_equal(weights.theta, THETA)
    explore = noise(1, 8)
    steps = run(frozen(robot), robot, explore, clipped=False)
    for step in steps:
        wish = step.solution.action + explore.noise[step.episode, step.time]
        np.testing.assert_array_equal(step.action, wish)
        np.testing.assert_array_equal(step.weights.theta, THETA)
    assert any((np.abs(step.action) > robot.plant.upper).any() for step in steps)


@pytest.mark.parametrize(
    ("make", "options"), [(expected_sarsa, {"constrained": True}), (q_learning, {})]
)
def test_where_actions_are_valued_the_solution_has_the_applied_action_first(robot, make, options):
    theta, learner = THETA, make(robot, paper.ALPHA)
    for step in run(learner, robot, noise(2, 5), **options):
        np.testing.assert_allclose(step.solution.action, step.action, atol=1e-12)
        fixed, free = (robot.solve(step.state, theta, None, a) for a in (step.action, None))
        assert step.solution.value == pytest.approx(fixed.value, rel=1e-6)
        assert step.plan.value == pytest.approx(free.value, rel=1e-6)
        theta = step.weights.theta
    steps = run(learner, robot, noise(1, 3), constrained=False)
    assert all(step.solution is step.plan for step in steps)


def call(robot, **options):
    given = {"learner": q_learning(robot, 1e-7), "controller": robot, "explore": noise(1, 3)}
    return train(**{"weights": Weights(THETA)} | given | options)


@pytest.mark.parametrize(
    ("refused", "message"),
    [
        (lambda _: Exploration(np.zeros((2, 5)), np.ones((2, 5))), r"\(2, 5\) .*\(episodes, steps"),
        (lambda _: Exploration(np.zeros((2, 5, 2)), np.ones((2, 4))), r"scale \(2, 4\): .*\(epis"),
        (lambda nmpc: call(nmpc, explore=noise(1, 3, 1)), "1 numbers a step; the NMPC has 2 i"),
        (lambda nmpc: call(nmpc, weights=THETA), r"weights = array.* must be Weights: write We"),
        (lambda nmpc: call(nmpc, clipped=False), r"clipped = .* \[0.6    1.5708\].* QL has no Q\("),
        (lambda nmpc: call(nmpc, controller=5), "controller = 5 must be an Nmpc"),
        (lambda nmpc: call(nmpc, weights=Weights(THETA[:5])), r"theta has shape \(5,\); it must "),
    ],
)
def test_arguments_that_cannot_be_trained_are_refused_at_the_call(robot, refused, message):
    with pytest.raises(ValueError, match=message):
        refused(robot)


def test_a_solve_in_the_state_itself_is_the_next_warm_start_and_else_the_plan_before():
    controller = Faulty(lambda call: False)
    expected = []
    for step in run(es(controller), controller, noise(1, 4)):
        expected += [step.solution, step.update.successor.solution]
    assert controller.warm_starts == [None, *expected[:-1]]
    controller.warm_starts.clear()
    plans = [step.solution for step in run(frozen(controller), controller, noise(2, 3))]
    assert controller.warm_starts == [None, *plans[:2], None, *plans[3:5]]


def test_noise_is_standard_normal_and_shrinks_by_the_rate_each_count():
    (e, t), shape, rng = np.indices((200, 130)), (200, 130, 2), np.random.default_rng(0)
    for count, power in ((count_steps, 130 * e + t), (count_episodes, e)):
        explore = Exploration.draw(rng, shape, decay_rate=0.999, count=count)
        np.testing.assert_allclose(explore.scale, 0.999**power)
        assert explore.noise.mean() == pytest.approx(0, abs=0.02)
        assert explore.noise.std() == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize("failing", [2, 3])  # the plan at t = 1, or the second solve after it
def test_a_solve_that_fails_ends_the_episode_and_learning_goes_on(failing):
    firsts, controller = [], Faulty(lambda call: call == failing)

    def step(theta, memory, transition, delta, successor):
        firsts.append(transition.first)
        return theta, memory

    rule = UpdateRule(step, interrupted=lambda theta, memory: (1.01 * theta, memory))
    steps = run(replace(es(controller), rule=rule), controller, noise(2, 3))
    assert places(steps) == [(0, 0), (0, 1), (1, 0), (1, 1), (1, 2)]
    assert firsts == [True, True, False, False]
    _, failed, begun, *_ = steps
    assert [f"call {failing} failed" in step.failure for step in steps] == [
        False,
        True,
        *[False] * 3,
    ]
    assert [step.last for step in steps] == [False, True, False, False, True]
    assert failed.update is None
    acted = failing == 3
    assert (failed.solution is not None, np.isfinite(failed.cost)) == (acted, acted)
    assert np.isfinite(failed.action).all() == acted
    np.testing.assert_array_equal(begun.state, controller.task.start)
    for step in steps[1:]:
        np.testing.assert_array_equal(step.weights.theta, 1.01 * THETA)


def test_ten_failed_episodes_in_a_row_are_a_divergence():
    """Nine fail at once, the tenth goes through, and ten more fail."""
    controller, steps = Faulty(lambda call: call not in (9, 10)), []
    with pytest.raises(Diverged, match="10 episodes in a row ended in a failed solve: call 20 fa"):
        steps.extend(train(frozen(controller), controller, Weights(THETA), noise(30, 2)))
    assert places(steps) == [*((e, 0) for e in range(10)), (9, 1), *((e, 0) for e in range(10, 20))]


@pytest.mark.parametrize("absurd", [np.nan, np.inf, -1e7])
@pytest.mark.parametrize("name", ["theta", "w"])
def test_weights_that_are_not_numbers_or_absurd_are_a_divergence(robot, name, absurd):
    added, steps = iter([0.0, 0.0, absurd]), []

    def step(theta, memory, *_):
        vectors = {"theta": theta.copy(), "w": memory.w.copy()}
        vectors[name][4] += next(added)
        return vectors["theta"], Auxiliary(vectors["w"])

    learner = replace(es(robot), rule=UpdateRule(step, first_w))
    with pytest.raises(Diverged, match=rf"(?s)^{name} .*left the numbers"):
        steps.extend(train(learner, robot, Weights(THETA), noise(2, 5)))
    assert places(steps) == [(0, 0), (0, 1), (0, 2)]  # the step itself is kept


@pytest.mark.parametrize(("factor", "steps"), [(2, 3), (1e4, 1)])
def test_how_large_theta_may_grow_depends_on_its_start(factor, steps):
    """A rate of Arrhenius's law, which multiplies exp(-25)."""
    problem = Problem(
        states=1, inputs=1, horizon=2, gamma=0.9, lower=-1, upper=1, theta={"rate": 7e10},
        model=lambda x, u, th: x + 0.1 * (u - th["rate"] * np.exp(-25) * x),
        stage=lambda x, u, th: x**2 + u**2,
    )  # fmt: skip
    nmpc, made = Nmpc(problem, solver="fatrop"), []
    grown = UpdateRule(lambda theta, memory, *_: (factor * problem.theta, memory))
    learner = replace(es(nmpc), rule=grown)
    plant = {"plant": lambda x, u, rng: (0.9 * x, 0.0, False), "start": [0.5]}
    outcome = nullcontext() if steps == 3 else pytest.raises(Diverged, match=r"^theta .* left the")
    with outcome:
        made.extend(train(learner, nmpc, Weights(problem.theta), noise(1, 3, 1), **plant))
    assert len(made) == steps


@pytest.mark.parametrize(
    ("solver", "theta", "cost"),  # of independent code, over t = 0, ..., 129 and not discounted
    [("riccati", THETA, 4695), ("ipopt", THETA, 4695), ("riccati", [*THETA[:-1], 0.35], 4119)],
)
def test_the_cost_without_noise_is_the_reference(solver, theta, cost):
    found = evaluate(paper.nmpc(solver=solver), np.array(theta), paper.STEPS)
    assert found.cost == pytest.approx(cost, abs=1)


def test_a_rollout_reaches_the_target_within_all_bounds_and_adds_up_its_costs(robot):
    plant, task, ran = robot.plant, robot.task, evaluate(robot, THETA, paper.STEPS)
    by_hand = [task.stage_cost(s, a) for s, a in zip(ran.states, ran.actions, strict=True)]
    assert ran.cost == pytest.approx(sum(by_hand), rel=1e-14)
    assert task.distance(ran.states[-1]) < 0.1
    assert (task.overlap(ran.states) <= 1e-6).all()
    assert (np.abs(ran.actions) <= plant.upper).all()
    assert ((task.lower <= ran.states) & (ran.states <= task.upper)).all()


@pytest.mark.parametrize("first", [0, 3])  # call that fails
def test_a_rollout_that_fails_costs_infinity_and_keeps_its_steps(first):
    failed = evaluate(Faulty(lambda call: call >= first), THETA, 10)
    assert (failed.states.shape, failed.actions.shape) == ((first, 3), (first, 2))
    assert failed.cost == np.inf
    assert f"call {first} failed" in failed.failure
