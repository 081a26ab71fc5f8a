"""The suite: a row is the same twice, and what breaks the rules is told in a sentence."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.analysis import leaderboard
from nmpcrl.analysis.interaction import AmongMoving, OverBudget
from nmpcrl.analysis.leaderboard import (
    MOVING,
    Judged,
    NoEntry,
    entry_of,
    judge,
    judge_once,
    row,
    scenario_seed,
)
from nmpcrl.learning import evaluate
from nmpcrl.study import ParameterError, paper, published
from nmpcrl.study.population import JUDGE
from nmpcrl.study.robot import NmpcPolicy

THETA = np.array(paper.THETA_INIT)
LAYOUT = JUDGE["J001"]
GOOD = Judged(initial=4000.0, cost=3000.0, arrived=True, episodes=5, seconds=1.0)


@pytest.fixture
def entry(monkeypatch):
    """A function that makes an entry of a factory, and judges it in the first layout."""

    def made(factory, budget=3):
        monkeypatch.setitem(leaderboard.ENTRIES, "made", factory)
        return judge_once("made", LAYOUT, budget, 1)

    return made


@pytest.fixture
def module(tmp_path, monkeypatch):
    """A module in the working directory, with some text."""

    def write(text):
        (tmp_path / "of_my_own.py").write_text(text)
        monkeypatch.chdir(tmp_path)
        monkeypatch.delitem(__import__("sys").modules, "of_my_own", raising=False)

    return write


def test_frozen_solves_what_theta_init_does_and_gains_nothing(entry):
    found = entry(lambda robot: THETA)
    assert found.solved
    assert found.gain == 0
    assert found.episodes == 0
    controller = paper.nmpc(LAYOUT)
    assert found.cost == evaluate(controller, THETA, paper.STEPS).cost


def test_a_policy_is_judged_as_theta_is(entry):
    assert entry(lambda robot: NmpcPolicy()).cost == entry(lambda robot: THETA).cost


def test_a_policy_that_stands_still_solves_nothing(entry):
    found = entry(lambda robot: lambda observation: np.zeros(2))
    assert not found.arrived
    assert not found.solved
    assert found.gain < 0


def test_a_theta_that_no_solver_takes_costs_infinitely_much(entry):
    found = entry(lambda robot: np.full(9, 1e9))
    assert found.cost == np.inf
    assert not found.solved


def caught(robot):
    """Goes beyond its budget and hides it."""
    for _ in range(robot.budget + 1):
        with suppress(ValueError):
            robot.cost(THETA)
    return THETA


def late(robot):
    """Goes beyond its budget while it is judged."""
    env, policy = robot.env(), NmpcPolicy()

    def act(observation):
        env.reset()
        return policy(observation)

    return act


@pytest.mark.parametrize("factory", [caught, late])
def test_one_episode_too_many_is_seen_even_if_it_is_hidden_or_late(entry, factory):
    assert entry(factory).over


def test_a_budget_that_is_spent_to_the_last_episode_is_kept(entry):
    def spend(robot):
        costs = [robot.cost(THETA) for _ in range(robot.budget)]
        assert robot.left == 0
        return THETA + 0 * costs[0]

    found = entry(spend)
    assert not found.over
    assert found.episodes == 3


@pytest.mark.parametrize("answer", [None, 3, np.zeros(8), np.full(9, np.nan), "theta"])
def test_what_is_neither_theta_nor_a_policy_is_refused(entry, answer):
    with pytest.raises(ParameterError, match=r"what the entry returned = .* must be 9 finite num"):
        entry(lambda robot: answer)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nonsense", "policy = 'nonsense' must be MODULE:FACTORY, or one that ships"),
        (":factory", "must be MODULE:FACTORY"),
        ("no_such_module:factory", "cannot be imported: ModuleNotFoundError: No module named"),
        ("of_my_own:other", "cannot be imported: AttributeError: module 'of_my_own' has no attr"),
        ("of_my_own:number", "must name a function of a Robot, and is 3"),
    ],
)
def test_what_is_no_entry_is_refused_in_a_sentence(module, name, message):
    module("number = 3")
    with pytest.raises(NoEntry, match=message):
        judge(name, progress=False)


def test_a_module_that_fails_says_why(module):
    module("raise RuntimeError('not today')")
    with pytest.raises(NoEntry, match="cannot be imported: RuntimeError: not today"):
        entry_of("of_my_own:factory")


@pytest.mark.usefixtures("trains_here")
def test_an_entry_that_fails_says_where(module):
    module("def factory(robot): raise KeyError('x')")
    with pytest.raises(NoEntry, match="'of_my_own:factory' failed in J001: KeyError: 'x'"):
        judge("of_my_own:factory", layouts=1, seeds=1, progress=False)


@pytest.mark.parametrize(
    "nonsense", [{"budget": 0}, {"layouts": 121}, {"layouts": 0}, {"seeds": 0}]
)
def test_a_number_that_makes_no_sense_is_refused(nonsense):
    (name,) = nonsense
    with pytest.raises(ParameterError, match=f"{name} = "):
        judge("ES", **nonsense)


@pytest.mark.usefixtures("trains_here")
def test_two_calls_give_the_same_row_but_for_its_time():
    first, again = (
        replace(judge("CMA-ES", budget=3, layouts=2, seeds=2, progress=False), seconds=0)
        for _ in range(2)
    )
    assert first == again
    assert (first.entry, first.layouts, first.episodes) == ("CMA-ES", 2, 3)
    assert first.disqualified == ""


def test_a_layout_is_solved_if_it_is_under_every_seed():
    missed = replace(GOOD, arrived=False)
    found = row("x", 5, {"J001": [GOOD, GOOD], "J002": [GOOD, missed], "J003": [missed, missed]})
    assert found.solved.value == pytest.approx(1 / 3)
    assert found.gain.value == pytest.approx(0.25)


def test_who_costs_more_than_theta_init_has_not_solved():
    assert GOOD.solved
    assert replace(GOOD, cost=GOOD.initial).solved
    assert not replace(GOOD, cost=GOOD.initial + 1).solved


def test_the_gain_is_over_layouts_and_not_over_seeds():
    """A layout with more seeds weighs as much as one with fewer."""
    poor = replace(GOOD, cost=4000.0)
    found = row("x", 5, {"J001": [poor] * 9, "J002": [GOOD]})
    assert found.gain.value == pytest.approx(0.125)


def test_who_began_too_many_is_disqualified_with_the_layout():
    over = replace(GOOD, over=True)
    found = row("x", 5, {"J001": [GOOD], "J002": [over]})
    assert found.disqualified == "it began more than 5 episodes in J002"


def among_moving(name, place="M03", budget=50, k=0):
    """An entry in a scenario."""
    seed = scenario_seed(place, k)
    return judge_once(name, MOVING.places[place], budget, seed, AmongMoving)


@pytest.mark.parametrize(("entry", "policy"), [("frozen", "init"), ("grid", "grid"),
                                               ("CMA-ES", "CMA-ES")])  # fmt: skip
@pytest.mark.parametrize("place", ["M03", "M04"])
def test_a_search_among_moving_obstacles_ends_where_the_published_one_did(entry, policy, place):
    table = published.read("worlds")
    chosen = (table.part == "moving") & (table.arm == f"extrapolated {policy}")
    known = table[chosen & (table.place == place) & (table.k == 0)].iloc[0]
    found = among_moving(entry, place)
    assert found.cost == pytest.approx(known.cost, rel=1e-4)
    assert (found.inside, found.arrived) == (known.inside, known.arrived)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["ES", "DES", "RDES", "QL", "TDRC", "undone-LSTD-Q", "DPG", "SPSA"]
)
def test_learners_and_tuners_are_judged_among_moving_obstacles_too(name):
    found = among_moving(name, budget=3)
    assert found.initial == among_moving("frozen").cost
    assert 0 < found.cost < np.inf
    assert 0 < found.episodes <= 3
    assert not found.over


def test_what_needs_the_papers_own_task_says_so_among_moving_obstacles():
    with pytest.raises(ValueError, match="GN-J differentiates a task's cost and its plant"):
        among_moving("GN-J", budget=3)


def test_the_environment_has_the_obstacles_of_each_step_and_the_cost_of_a_rollout():
    robot = AmongMoving(MOVING.places["M04"], 2, 0)
    rollout, env = robot.rollout(THETA), robot.env()
    observation, _ = env.reset()
    steps = zip(rollout.states, rollout.actions, rollout.costs, strict=True)
    for t, (state, action, cost) in enumerate(steps):
        expected = [one(np.array([0.2 * t]))[0] for one in robot.motions]
        np.testing.assert_allclose(observation, np.r_[state, np.ravel(expected)], atol=1e-12)
        observation, reward, _, over, _ = env.step(action)
        assert -reward == cost
    assert over
    with pytest.raises(OverBudget):
        robot.cost(THETA)


def test_a_row_among_moving_obstacles_counts_the_scenarios_in_which_none_is_entered():
    inside = replace(GOOD, inside=3)
    found = row("made", 5, {"M01": [GOOD, inside], "M02": [GOOD, GOOD]})
    assert found.clear.value == 0.5
