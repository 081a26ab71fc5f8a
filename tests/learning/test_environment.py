"""Environments other than the plan's model: plants, costs, starts, ends and data."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from learning.small_runs import THETA, noise, run

from nmpcrl.control import Plant, differential_drive
from nmpcrl.control.solution import short
from nmpcrl.learning import Diverged, evaluate, expected_sarsa, frozen, q_learning

PRICES = np.array([0.1, 2.0, 0.5, 0.1, 3.0])


def selling(state, action, rng):
    return 0.8 * state + action, float(action[0]), False


SELLING = {"plant": selling, "start": [0.2], "data": {"price": PRICES}}


def filling(state, action, rng):
    """The tank as it is: another gain, a disturbance, a cost of its own, and an end."""
    later = 0.9 * state + 0.3 * action + rng.normal(scale=0.01, size=1)
    return later, abs(state[0] - 1), later[0] > 0.9


def cut(state, action, rng):
    """The same, ended by its time alone."""
    later, cost, _ = filling(state, action, rng)
    return later, cost, False, later[0] > 0.3


@pytest.mark.parametrize("plant", [None, differential_drive(), differential_drive(period=0.1)])
def test_a_plant_is_charged_the_tasks_cost_and_is_by_default_the_plans(robot, plant):
    advance, task = (plant or robot.plant).step, robot.task
    rollout = evaluate(robot, THETA, 5, plant=plant)
    later = [advance(s, a) for s, a in zip(rollout.states, rollout.actions, strict=True)]
    np.testing.assert_array_equal(rollout.states, [task.start, *later[:-1]])
    assert rollout.costs[0] == task.stage_cost(task.start, rollout.actions[0])


@pytest.mark.parametrize("plant", [filling, cut])
def test_a_function_steps_charges_and_ends_in_a_state_worth_nothing_or_cuts(tank, plant):
    how = {"plant": plant, "start": lambda rng: rng.uniform(0, 0.25, 1), "rng": 1}
    steps = run(expected_sarsa(tank, 1e-3), tank, noise(3, 60, 1, deviation=0.1), **how)
    last = [step for step in steps if step.last]
    assert [(step.episode, step.end) for step in last] == [(k, plant is filling) for k in range(3)]
    assert all(step.time < 59 for step in last)
    assert len({step.state[0] for step in steps if step.time == 0}) == 3
    for step in last:
        worth = step.update.successor.value
        assert (worth == 0, not step.update.successor.features.any()) == (step.end, step.end)
        assert step.update.delta == pytest.approx(step.cost + 0.9 * worth - step.solution.value)
    rollout, again = (evaluate(tank, tank.problem.theta, 60, **how) for _ in range(2))
    assert len(rollout.costs) < 60
    np.testing.assert_allclose(rollout.costs, np.abs(rollout.states[:, 0] - 1))
    np.testing.assert_array_equal(rollout.states, again.states)


ONLY_PLANS = "a Problem plans, and says nothing of the environment"
NO_STATE = r"^start .*; a state is 1 finite numbers"
FILLING = {"plant": filling, "start": [0.0]}
THREE = Plant(lambda s, a: [a, a, a], ("a", "b", "c"), ("u",), [-1], [1])
SLOW = replace(differential_drive(), upper=[0.5, 1.5])
NARROW = r"\[-0.6 .* and \[0.5 1.5\], and those of the plan between .* \[0.6    1.5708\]"
TWO_STATES = FILLING | {"plant": lambda s, a, rng: ([1, 2], 0, False)}


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("tank", {"plant": filling}, ONLY_PLANS),
        ("tank", FILLING | {"plant": lambda state, action: 0}, r"plant is called as plant\(state"),
        ("tank", FILLING | {"plant": lambda s, a, rng: s}, r"returns \(next state, cost, end\)"),
        ("tank", FILLING | {"plant": 5}, "plant is called as .* not a callable"),
        ("tank", TWO_STATES, "a state is 1 finite numbers"),
        ("tank", FILLING | {"start": [np.nan]}, NO_STATE),
        ("tank", FILLING | {"start": [1.0, 2.0]}, NO_STATE),
        ("tank", FILLING | {"start": "here"}, NO_STATE),
        ("tank", SELLING | {"data": {"price": 1.0}}, "data 'price' must be an array with an axis"),
        ("robot", {"plant": THREE}, "the plant has 3 states and 1 inputs, and the plan 3"),
        ("robot", {"plant": SLOW}, NARROW),
    ],
)
def test_arguments_that_make_no_environment_are_refused(request, name, options, message):
    nmpc = request.getfixturevalue(name)
    with pytest.raises(ValueError, match=message):
        evaluate(nmpc, nmpc.problem.theta, 1, **options)


@pytest.mark.parametrize(
    ("later", "end", "ran"),  # state, end of the episode, whether the plant ran away
    [(np.nan, False, True), (np.nan, True, True), (-np.inf, False, True), (2e9, False, True),
     (2e9, True, False), (1e9, False, False)],
)  # fmt: skip
def test_a_plant_that_runs_away_is_a_failed_solve(tank, later, end, ran):
    how = {"plant": lambda state, action, rng: (np.array([later]), 0.5, end), "start": [0.1]}
    rollout = evaluate(tank, tank.problem.theta, 1, **how)
    assert (rollout.states, rollout.costs) == ([[0.1]], [0.5])
    assert (rollout.cost, bool(rollout.failure)) == ((np.inf, True) if ran else (0.5, False))
    if not ran:
        return
    assert re.search(rf"\[{re.escape(short(later))}\].* ran away", rollout.failure)
    for learner in (expected_sarsa(tank, 1e-3), q_learning(tank, 1e-3)):
        steps = run(learner, tank, noise(2, 3, 1), **how)
        assert [(s.episode, s.time, s.cost, s.last, s.failure) for s in steps] == [
            (k, 0, 0.5, True, rollout.failure) for k in range(2)
        ]
        with pytest.raises(Diverged, match=r"10 episodes in a row .* ran away"):
            run(learner, tank, noise(10, 3, 1), **how)


def test_a_cost_that_is_no_number_ends_the_episode_and_leaves_theta(tank):
    how = {"plant": lambda state, action, rng: (state, np.nan, False), "start": [0.1]}
    assert "cost in state [0.1] is nan" in evaluate(tank, tank.problem.theta, 1, **how).failure
    with pytest.raises(Diverged, match=r"10 episodes in a row .* cost in state \[0.1\] is nan"):
        run(expected_sarsa(tank, 1e-3), tank, noise(10, 3, 1), **how)


@pytest.mark.parametrize("broken", ["plant", "start", "data"])
def test_an_error_inside_a_function_of_the_user_is_that_error(tank, broken):
    def fails(*given):
        raise TypeError("mine")

    with pytest.raises(ValueError, match=f"^{broken} is called as {broken}"):
        evaluate(tank, tank.problem.theta, 2, **SELLING | {broken: lambda: None})
    with pytest.raises(TypeError, match=r"^mine$"):
        evaluate(tank, tank.problem.theta, 2, **SELLING | {broken: fails})


def test_a_plan_sees_the_data_of_its_stages(tank):
    theta = tank.problem.theta
    rollout = evaluate(tank, theta, 4, **SELLING)
    windows = [PRICES[[0, 1, 2, 3]], PRICES[1:], PRICES[[2, 3, 4, 4]], PRICES[[3, 4, 4, 4]]]
    for state, action, prices in zip(rollout.states, rollout.actions, windows, strict=True):
        plan = tank.solve(state, theta, data={"price": prices})
        np.testing.assert_allclose(action, plan.action, atol=1e-6)
    called = {"data": lambda t: {"price": windows[t] if t < 4 else 0.0}}
    same = evaluate(tank, theta, 4, **SELLING | called)
    np.testing.assert_array_equal(rollout.actions, same.actions)


@pytest.mark.parametrize("data", [{"price": PRICES}, lambda t: {"price": PRICES[t]}])
def test_a_problems_plant_costs_what_the_data_of_its_time_say(tank, data):
    plant, theta = tank.problem.plant(), tank.problem.theta
    rollout = evaluate(tank, theta, 4, plant=plant, start=[0.2], data=data)
    pairs = zip(rollout.states, rollout.actions, PRICES[:4], strict=True)
    costs = [tank.problem.cost(x, u, data={"price": price}) for x, u, price in pairs]
    assert rollout.costs.tolist() == costs
    run_alone = [step.cost for step in run(frozen(tank), tank, noise(1, 4, 1, deviation=0.0),
                                           plant=plant, start=[0.2], data=data)]  # fmt: skip
    assert run_alone == costs
    assert len({*costs}) == 4


@pytest.mark.parametrize("constrained", [False, True])
def test_the_next_state_is_valued_with_the_data_of_the_next_time(tank, constrained):
    es, how = expected_sarsa(tank, 1e-3), SELLING | {"constrained": constrained}
    for step, later in pairwise(run(es, tank, noise(2, 3, 1, deviation=0.1), **how)):
        if not step.last:
            seen = step.update.successor.solution.data
            np.testing.assert_array_equal(seen[:, 0], later.plan.data[:, 0])
        assert step.solution.data[0, 0] == PRICES[step.time]


def test_a_plant_may_write_into_its_arguments_and_draws_nothing_that_others_draw(tank):
    mine = np.zeros(1)

    def in_place(state, action, rng):
        np.clip(action, -0.1, 0.1, out=action)  # as an actuator does
        state += 0.5 * action
        return state, float(state[0] ** 2), False

    def careful(state, action, rng):
        return in_place(state.copy(), action.copy(), rng)

    def returned(state, action, rng):
        mine[:], cost, end = careful(state, action, rng)
        return mine, cost, end

    found = []
    for plant in (in_place, returned, careful):
        start = np.array([0.3])
        steps = run(q_learning(tank, 1e-3), tank, noise(2, 4, 1), plant=plant, start=start)
        moved = [(*step.state, *step.action, *step.weights.theta) for step in steps]
        rollout = evaluate(tank, tank.problem.theta, 4, plant=plant, start=start)
        found.append((moved, rollout.states.tolist(), rollout.actions.tolist()))
        assert start == [0.3]
    assert found[0] == found[1] == found[2]
    drawn = []

    def plant(state, action, rng):
        drawn.append(rng.normal())
        return state, 0.0, False

    explore = noise(1, 30, 1)  # by `default_rng(0)`
    run(frozen(tank), tank, explore, plant=plant, start=[0.2], rng=0)
    evaluate(tank, tank.problem.theta, 30, plant=plant, start=[0.2], rng=0)
    assert len({*drawn, *explore.noise.ravel()}) == len(drawn) + 30
