"""What ships as an entry keeps to its budget, and is the learner that it is called after."""

import importlib.util

import numpy as np
import pytest

from nmpcrl.analysis.agents import AGENTS
from nmpcrl.analysis.entries import (
    ENTRIES,
    REMEDIES,
    STEPWISE,
    WRAPS,
    NoSetting,
    called,
    entry_with,
)
from nmpcrl.analysis.interaction import Robot
from nmpcrl.study import Experiment, paper, run
from nmpcrl.study.learners import LEARNERS

LAYOUT, THETA = paper.LAYOUTS["A"], np.array(paper.THETA_INIT)


@pytest.fixture
def short(monkeypatch):
    """Episodes of six steps."""
    monkeypatch.setattr(paper, "STEPS", 6)
    defaults = Experiment.__init__.__defaults__
    shortened = tuple(6 if one == 130 else one for one in defaults)
    monkeypatch.setattr(Experiment.__init__, "__defaults__", shortened)


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(
    "name", [one for one in ENTRIES if not one.endswith("-episode") and one not in AGENTS]
)
def test_an_entry_spends_its_budget_and_no_more_and_returns_the_same_theta_twice(name):
    if name == "Bayes" and not importlib.util.find_spec("optuna"):
        pytest.skip("needs the extra nmpcrl[search]")
    found, budget = [], 4
    for _ in range(2):
        robot = Robot(LAYOUT, budget, seed=7)
        found.append(ENTRIES[name](robot))
        assert robot.begun <= budget
        if "undone" not in name and name != "frozen":  # one may be left over, which confirms
            assert robot.begun == budget
    assert found[0].shape == (9,)
    assert np.isfinite(found[0]).all()
    np.testing.assert_array_equal(*found)


def test_an_entry_is_the_run_of_the_study():
    experiment = Experiment(learner="GES", episodes=2, seed=3, layout=LAYOUT)
    found = ENTRIES["GES"](Robot(LAYOUT, 2, seed=3))
    np.testing.assert_array_equal(found, run(experiment).steps["theta"][-1])


def test_an_entry_counts_k_as_its_name_says():
    experiment = Experiment(learner="ES", episodes=2, seed=3, layout=LAYOUT, decay="episode")
    found = ENTRIES["ES-episode"](Robot(LAYOUT, 2, seed=3))
    np.testing.assert_array_equal(found, run(experiment).steps["theta"][-1])


def test_what_is_undone_is_no_worse_than_theta_init():
    robot = Robot(LAYOUT, 7, seed=0)
    found = ENTRIES["undone-GN-J"](robot)
    assert robot.begun == 7  # theta_init's rollout, and three episodes with one each
    judge = Robot(LAYOUT, 2, seed=0)
    assert judge.cost(found) <= judge.cost(THETA)


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("name", ["undone-ES", "CMA-ES", "ES", "grid"])
def test_a_budget_of_one_episode_is_enough_for_an_entry(name):
    robot = Robot(LAYOUT, 1, seed=0)
    assert ENTRIES[name](robot).shape == (9,)
    assert robot.begun <= 1


def test_every_learner_remedy_and_tuner_has_an_entry_and_what_has_a_step_size_a_guard():
    assert {*LEARNERS, *REMEDIES, *AGENTS, "grid", "SPSA", "CMA-ES", "Bayes"} <= set(ENTRIES)
    assert {f"guarded-{name}" for name in STEPWISE} <= set(ENTRIES)
    assert {name.partition("-")[0] for name in ENTRIES} >= set(WRAPS)


@pytest.mark.parametrize(
    ("entry", "setting", "name"),
    [
        ("ES", {"alpha": 3e-7}, "ES[alpha=3e-07]"),
        ("ES", {"alpha": paper.ALPHA}, "ES"),
        ("TDRC", {"regularisation": 1e6, "alpha": 3e-7}, "TDRC[alpha=3e-07,regularisation=1e+06]"),
        ("SPSA", {"step": 0.3, "perturbed": 0.05}, "SPSA[step=0.3]"),
        ("undone-LSTD-Q", {"radius": 0.1, "every": 5}, "undone-LSTD-Q[radius=0.1,every=5]"),
    ],
)
def test_a_name_says_what_is_set_and_the_entry_has_it(entry, setting, name):
    assert called(entry, setting) == name
    made = entry_with(name)
    values = {**made.defaults, **dict(made.setting)}
    assert {key: values[key] for key in setting} == setting


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(
    "name",
    [
        "GES[alpha=1e-06]",
        "guarded-ES[alpha=1e-04]",
        "TDRC[regularisation=1e+06]",
        "GES-3[ratio=10]",
        "undone-LSTD-Q[radius=0.03]",
        "undone-LSTD-Q[every=2]",
        "DPG[radius=0.03]",
        "SPSA[step=0.3]",
        "SPSA[perturbed=0.15]",
        "CMA-ES[spread=0.1]",
    ],
)
def test_what_is_set_makes_a_difference_and_keeps_to_the_budget(name):
    robot, other = (Robot(LAYOUT, 7, seed=7) for _ in range(2))
    found = entry_with(name)(robot)
    assert robot.begun <= 7
    assert (found != ENTRIES[name.partition("[")[0]](other)).any()


@pytest.mark.usefixtures("short")
def test_with_another_step_size_the_ratio_to_beta_stays():
    experiment = Experiment(
        learner="GES", episodes=2, seed=3, layout=LAYOUT, alpha=3e-7, beta=3 * paper.BETA
    )
    found = entry_with("GES[alpha=3e-07]")(Robot(LAYOUT, 2, seed=3))
    np.testing.assert_allclose(found, run(experiment).steps["theta"][-1], rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("grid[step=1]", "'grid' has no 'step': nothing can be set"),
        ("frozen[alpha=1]", "'frozen' has no 'alpha': nothing can be set"),
        ("ES[radius=1]", "'ES' has no 'radius': can be set only alpha"),
        ("ES[alpha]", "must be written as ES"),
        ("ES[alpha=-1]", "alpha must be a finite number above 0"),
        ("undone-ES[every=1.5]", "every must be a whole number above 0"),
    ],
)
def test_what_cannot_be_set_is_refused_with_what_can(name, message):
    with pytest.raises(NoSetting, match=message):
        entry_with(name)
