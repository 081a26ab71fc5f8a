"""What ships as an entry keeps to its budget, and is the learner that it is called after."""

import importlib.util

import numpy as np
import pytest

from nmpcrl.analysis.entries import ENTRIES, REMEDIES, STEPWISE, WRAPS
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
@pytest.mark.parametrize("name", [name for name in ENTRIES if not name.endswith("-episode")])
def test_an_entry_spends_its_budget_and_no_more_and_returns_the_same_theta_twice(name):
    if name == "Bayes" and not importlib.util.find_spec("optuna"):
        pytest.skip("needs the extra nmpcrl[search]")
    found, budget = [], 4
    for _ in range(2):
        robot = Robot(LAYOUT, budget, seed=7)
        found.append(ENTRIES[name](robot))
        assert robot.begun <= budget
        if "undone" not in name:  # one may be left over, or more where nothing is learned
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
    assert {*LEARNERS, *REMEDIES, "grid", "SPSA", "CMA-ES", "Bayes"} <= set(ENTRIES)
    assert {f"guarded-{name}" for name in STEPWISE} <= set(ENTRIES)
    assert {name.partition("-")[0] for name in ENTRIES} >= set(WRAPS)
