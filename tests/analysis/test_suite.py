"""The suite: every episode counts, an entry is what its name says, and judgements repeat."""

import importlib.util
import sys
from contextlib import suppress
from dataclasses import asdict, replace
from unittest.mock import ANY

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis import suite
from nmpcrl.analysis.suite import ENTRIES, Judgement, Robot, entry, gain, judge, judge_all, solved
from nmpcrl.control import Policy
from nmpcrl.learning import Exploration, Weights, evaluate, expected_sarsa, train
from nmpcrl.study import Experiment, ParameterError, paper, published, run
from nmpcrl.study.drawn import JUDGE, SCENARIOS
from nmpcrl.study.refusal import Refusal

LAYOUT, THETA = paper.LAYOUTS["A"], np.array(paper.THETA_INIT)
QUICK = ("frozen", "TDRC", "GES-3", "guarded-ES", "averaged-ES", "undone-LSTD-Q")
GOOD = Judgement(initial=4000.0, cost=3000.0, arrived=True, episodes=5, seconds=1.0)


@pytest.fixture
def short(monkeypatch):
    """Episodes of six steps."""
    monkeypatch.setattr(paper, "STEPS", 6)
    defaults = Experiment.__init__.__defaults__
    shortened = tuple(6 if one == 130 else one for one in defaults)
    monkeypatch.setattr(Experiment.__init__, "__defaults__", shortened)


def test_a_robot_trains_and_rolls_out_as_the_library_does_and_begins_no_episode_too_many():
    robot = Robot("B", 5, 0)
    noise = Exploration.draw(np.random.default_rng(0), (3, 3, 2))
    learner, start = expected_sarsa(robot.controller, paper.ALPHA), Weights(THETA, np.zeros(9))
    known = [*train(learner, robot.controller, start, noise)]
    training = robot.train(learner, start, noise)
    assert robot.begun == 0  # until its first step
    found = [next(training) for _ in range(7)]
    for one, other in zip(found, known[:7], strict=True):
        np.testing.assert_array_equal(one.weights.theta, other.weights.theta)
    assert robot.begun == 3  # the last of which was left early
    assert robot.cost(THETA) == evaluate(robot.controller, THETA, paper.STEPS).cost
    _, info = robot.env().reset(options={"layout": "A"})
    assert info["layout"] == paper.LAYOUTS["B"]
    assert robot.left == 0
    for more in (lambda: robot.cost(THETA), lambda: robot.env().reset(),
                 lambda: next(robot.train(learner, start, noise))):  # fmt: skip
        with pytest.raises(suite.OverBudget, match=r"episode \d was begun with a budget of 5"):
            more()


def test_among_moving_obstacles_the_environment_is_that_of_a_rollout():
    robot = Robot("M04", 2, 0)
    rollout, env = robot.rollout(THETA), robot.env()
    observation, _ = env.reset()
    steps = zip(rollout.states, rollout.actions, rollout.costs, strict=True)
    for t, (state, action, cost) in enumerate(steps):
        expected = [one(np.array([0.2 * t]))[0] for one in robot.motions]
        np.testing.assert_allclose(observation, np.r_[state, np.ravel(expected)], atol=1e-12)
        observation, reward, _, over, _ = env.step(action)
        assert -reward == cost
    assert over
    with pytest.raises(suite.OverBudget):
        robot.cost(THETA)


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("name", ENTRIES)
def test_an_entry_spends_its_budget_and_no_more_and_a_setting_makes_a_difference(name):
    if name == "Bayes" and not importlib.util.find_spec("optuna"):
        pytest.skip("needs the extra nmpcrl[search]")
    one, budget = ENTRIES[name], 7
    others = {key: 2 if isinstance(value, int) else 0.3 * value
              for key, value in one.defaults.items()}  # fmt: skip
    kinds = [one, one, *(one.with_settings(**{key: value}) for key, value in others.items())]
    found = []
    for each in kinds:
        robot = Robot(LAYOUT, budget, seed=7)
        found.append(each(robot))
        assert robot.begun <= budget
        assert robot.begun == budget or "undone" in name or name == "frozen"
        assert np.isfinite(found[-1]).all()
    np.testing.assert_array_equal(found[0], found[1])
    if "DES" not in name and name != "undone-ES":  # too few examples here; every step undone
        assert all((other != found[0]).any() for other in found[2:]), kinds
    least = Robot(LAYOUT, 1, seed=0)
    assert one(least).shape == (9,)
    assert least.begun <= 1


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(
    ("name", "alpha", "beta"),
    [("GES", paper.ALPHA, paper.BETA), ("QL", paper.ALPHA, paper.BETA),
     ("GES", 3e-7, 3e-7 / paper.ALPHA * paper.BETA)],
)  # fmt: skip
def test_an_entry_is_the_run_of_the_study_and_beta_keeps_its_ratio(name, alpha, beta):
    experiment = Experiment(learner=name, episodes=2, seed=3, layout=LAYOUT, alpha=alpha, beta=beta)
    found = suite.learned(Robot(LAYOUT, 2, seed=3), learner=name, alpha=alpha)
    np.testing.assert_allclose(found, run(experiment).steps["theta"][-1], rtol=1e-12)


@pytest.mark.parametrize(
    ("base", "settings", "name"),
    [
        ("ES", {"alpha": 3e-7}, "ES[alpha=3e-07]"),
        ("TDRC", {"regularisation": 1e6, "alpha": 3e-7}, "TDRC[alpha=3e-07,regularisation=1e+06]"),
        ("SPSA", {"step": 0.3, "perturbed": 0.05}, "SPSA[step=0.3]"),
        ("undone-LSTD-Q", {"radius": 0.1, "every": 5}, "undone-LSTD-Q[radius=0.1,every=5]"),
    ],
)
def test_the_name_of_an_entry_has_its_settings_and_gives_it_back(base, settings, name):
    assert str(ENTRIES[base].with_settings(**settings)) == name
    assert entry(name).settings | settings == entry(name).settings
    assert (entry(name).name, str(entry(name))) == (base, name)


@pytest.mark.usefixtures("trains_here")
@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("grid[step=1]", {}, "setting = 'step' must be absent for entry 'grid'"),
        ("ES[radius=1]", {}, "setting = 'radius' must be one of alpha for entry 'ES'"),
        ("ES[alpha=-1]", {}, "alpha = -1.0 must be a finite number above 0"),
        ("undone-ES[every=1.5]", {}, "every = 1.5 must be a whole number above 0"),
        ("nonsense", {}, "entry = 'nonsense' must be MODULE:FACTORY or one of frozen, grid"),
        ("mine_for_suite:other", {}, "cannot be imported: AttributeError"),
        ("mine_for_suite:fails", {"layouts": 1}, "fails' failed in J001: KeyError: 'x'"),
        *(("ES", {name: value}, f"{name} = {value}")
          for name, value in (("budget", 0), ("layouts", 121), ("seeds", 0))),
    ],
)  # fmt: skip
def test_an_unknown_entry_a_failing_one_and_a_number_out_of_range_are_refused(
    tmp_path, monkeypatch, name, options, message
):
    text = "number = 3\ndef fails(robot): raise KeyError('x')"
    (tmp_path / "mine_for_suite.py").write_text(text)
    monkeypatch.delitem(sys.modules, "mine_for_suite", raising=False)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Refusal, match=message):
        judge_all(name, **options)


def acting(robot):
    """The NMPC with theta_init as a policy."""
    policy = Policy(robot.controller, THETA)
    return lambda observation: policy(observation[:3])


def test_theta_and_a_policy_are_judged_alike_by_the_cost_of_a_rollout():
    found = judge(lambda robot: THETA, "J001", 1, 3)
    assert solved(found)
    assert (gain(found), found.episodes) == (0, 0)
    assert found.cost == evaluate(paper.nmpc(JUDGE["J001"]), THETA, paper.STEPS).cost
    assert judge(acting, "J001", 1, 3) == replace(found, seconds=ANY)
    still = judge(lambda robot: lambda observation: np.zeros(2), "J001", 1, 3)
    assert not still.arrived
    assert gain(still) < 0
    beyond = judge(lambda robot: np.full(9, 1e9), "J001", 1, 3)
    assert beyond.cost == np.inf
    more = [replace(found, cost=found.initial + one) for one in (0, 1)]
    assert [solved(one) for one in (*more, beyond)] == [True, False, False]


def spend(robot, more=0):
    """Begin as many episodes as the budget has, or more, and hide the refusal."""
    for _ in range(robot.budget + more):
        with suppress(suite.OverBudget):
            robot.cost(THETA)
    return THETA


def late(robot):
    """Begin episodes while the policy is judged."""
    env, policy = robot.env(), acting(robot)
    return lambda observation: (env.reset(), policy(observation))[1]


@pytest.mark.parametrize(
    ("factory", "over"), [(spend, False), (lambda robot: spend(robot, 1), True), (late, True)]
)
def test_one_episode_too_many_is_seen_even_if_it_is_hidden_or_late(factory, over):
    found = judge(factory, "J001", 1, 3)
    assert (found.over, found.episodes) == (over, 3)


THETAS = (None, 3, np.zeros(8), np.full(9, np.nan), "theta")
ACTIONS = ([0.1], [np.nan, 0.0], "north")


@pytest.mark.parametrize(
    ("answer", "said"),
    [*((one, "what the entry returned = .* must be 9 finite") for one in THETAS),
     *((lambda seen, one=one: one, "what the policy chose = .* must be 2 finite")
       for one in ACTIONS)],
)  # fmt: skip
def test_what_is_neither_theta_nor_a_policy_nor_an_action_is_refused(answer, said):
    with pytest.raises(ParameterError, match=said):
        judge(lambda robot: answer, "J001", 1, 2)


def _need_current(name, part):
    if not published.is_current(name, part):
        pytest.skip(f"the published rows of {name}, {part}, are of earlier epochs")


@pytest.mark.parametrize(
    "base", [pytest.param(one, marks=() if one in QUICK else pytest.mark.slow) for one in ENTRIES]
)
def test_an_entry_ends_where_the_published_one_did(base):
    _need_current("remedies", "judge 50")
    table = published.read("remedies")
    known = table[(table.part == "judge 50") & (table.entry == base)].iloc[0]
    found = judge(entry(known.arm), known.place, suite.seed_of(known.place, known.k), 50)
    assert found.cost == pytest.approx(known.cost, rel=1e-4)
    assert (found.episodes, found.arrived) == (known.episodes, known.arrived)


def test_seeds_are_held_out_and_no_two_places_share_one():
    seeds = [suite.seed_of(name, k) for name in (*suite.LAYOUTS, *SCENARIOS) for k in (0, 9)]
    assert len({*seeds}) == len(seeds)
    assert min(seeds) >= suite.HELD_OUT


MISSED, POOR = replace(GOOD, arrived=False), replace(GOOD, cost=4000.0)
OVER, INSIDE = replace(GOOD, over=True), replace(GOOD, inside=3)


@pytest.mark.parametrize(
    ("judged", "column", "expected"),
    [
        ([[GOOD, GOOD], [GOOD, MISSED], [MISSED, MISSED]], "solved", 1 / 3),  # under every seed
        ([[POOR] * 9, [GOOD]], "gain", 0.125),  # places weigh the same
        ([[GOOD, INSIDE], [GOOD, GOOD]], "clear", 0.5),
        ([[GOOD], [OVER]], "over", "P1"),
        ([[GOOD, GOOD], [GOOD]], "over", ""),
    ],
)
def test_a_row_has_shares_of_places_and_says_where_the_budget_was_exceeded(
    judged, column, expected
):
    places = [
        pd.DataFrame(map(asdict, each)).assign(place=f"P{i}") for i, each in enumerate(judged)
    ]
    found = suite.scores(pd.concat(places))[column]
    assert getattr(found, "value", found) == pytest.approx(expected)
