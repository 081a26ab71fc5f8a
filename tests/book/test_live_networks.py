"""The live figure of DES and RDES: a page fits networks as Python does, and a reader stops it."""

import numpy as np
import pytest
from live_page import OTHERWISE

from nmpcrl.analysis import metrics
from nmpcrl.report.live import two_learners
from nmpcrl.study import Experiment, paper, run

FIGURE = "networks"
TRAINED = "([figure, count]) => figure.shown.found.every(one => one.episode >= count)"


def assert_equal_to_python(shown: dict, episodes: int, **changes) -> None:
    """Weights, the error of each episode and the cost: to single precision, so early."""
    for found in shown["found"]:
        records = run(Experiment(learner=found["learner"], episodes=episodes, **changes))
        assert found["episode"] == episodes
        theta = records.steps["theta"][-1]
        np.testing.assert_allclose(found["theta"], theta, rtol=0, atol=1e-5 * np.abs(theta).max())
        error = metrics.online_error(records)
        errors = metrics.by_episode(records, error, metrics.root_mean_square)
        np.testing.assert_allclose(found["errors"], errors, rtol=1e-3)
        first = found["costs"][0]["cost"]
        assert first == pytest.approx(records.evaluations["cost"][0], rel=1e-9)


def test_two_episodes_are_those_of_the_library(tab):
    tab.click("One episode")
    tab.click("One episode")
    assert_equal_to_python(tab.shown(), 2)


def test_they_are_with_another_seed_decay_and_alpha(tab):
    tab.ask_otherwise()
    tab.click("One episode")
    tab.click("One episode")
    assert_equal_to_python(tab.shown(), 2, **OTHERWISE)


def test_before_the_first_fit_nothing_moves(tab):
    tab.figure.get_by_role("button", name="One step").focus()
    for _ in range(3):
        tab.page.keyboard.press("Enter")
    for found in tab.shown()["found"]:
        assert found["step"]["time"] == 2
        assert found["theta"] == list(paper.THETA_INIT)
        assert found["errors"] == []


def test_it_trains_until_it_is_stopped_and_the_network_with_theta_errs_less(tab):
    tab.click("Train")
    tab.page.wait_for_function(TRAINED, arg=[tab.figure.element_handle(), 20])
    tab.click("Stop")
    shown = tab.shown()
    tab.later()
    assert tab.shown() == shown
    des, rdes = shown["found"]
    assert 20 <= des["episode"] < two_learners.EPISODES
    assert tab.figure.locator("progress").evaluate("bar => bar.value") == des["episode"]
    assert rdes["errors"][19] < 0.5 * des["errors"][19]
    tab.quiet()
    said = tab.figure.get_by_role("status").inner_text()
    count = len(rdes["errors"])
    assert f"error of the next value in episode {count} {rdes['errors'][-1]:.1f}" in said
    tab.click("Reset all")
    assert [one["episode"] for one in tab.shown()["found"]] == [0, 0]


@pytest.mark.weekly
def test_it_ends_by_itself_after_sixty_episodes(tab):
    tab.click("Train")
    arg = [tab.figure.element_handle(), two_learners.EPISODES]
    tab.page.wait_for_function(TRAINED, arg=arg)
    assert tab.figure.get_by_role("button", name="Train", exact=True).is_disabled()
    for found in tab.shown()["found"]:
        judged = [one["episode"] for one in found["costs"]]
        assert judged == [0, 10, 20, 30, 40, 50, 60]


def test_many_runs_need_no_more_memory(tab):
    """A network's numbers are given back after each fit, so that seeds can be tried for long."""
    for seed in range(1, 5):
        tab.figure.get_by_label("Seed").select_option(str(seed))
        tab.shown()
        tab.click("One episode")
        tab.click("One episode")
        assert [one["episode"] for one in tab.shown()["found"]] == [2, 2]
    assert_equal_to_python(tab.shown(), 2, seed=4)


def test_with_reduced_motion_the_pictures_change_at_the_end_alone(opened):
    tab = opened(FIGURE, reduced_motion="reduce").begun()
    tab.figure.evaluate(
        """figure => {
          window.changes = 0
          new MutationObserver(all => window.changes += all.length)
            .observe(figure.querySelector(".sides"), {subtree: true, childList: true})
        }"""
    )
    tab.click("Train")
    tab.page.wait_for_function(
        "figure => figure.querySelector('progress').value >= 2", arg=tab.figure.element_handle()
    )
    assert tab.page.evaluate("window.changes") == 0
    tab.click("Stop")
    tab.shown()
    assert tab.page.evaluate("window.changes") > 0
