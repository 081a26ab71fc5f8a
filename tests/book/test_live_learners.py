"""The live figure of ES and GES: a page trains as Python does, and a reader stops it."""

import numpy as np
import pytest
from live_page import OTHERWISE

from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import Experiment, run

FIGURE = "learners"
EPISODES = "([figure, count]) => figure.shown.found.every(one => one.costs.length >= count)"
PICTURES = """figure => {
  window.changes = 0
  new MutationObserver(all => window.changes += all.length)
    .observe(figure.querySelector(".sides"), {subtree: true, childList: true})
}"""


def assert_equal_to_python(shown: dict, episodes: int, **changes) -> None:
    """The weights of both learners after so many episodes."""
    for found in shown["found"]:
        records = run(Experiment(learner=found["learner"], episodes=episodes, **changes))
        assert found["episode"] == episodes
        theta, w = records.steps["theta"][-1], records.steps["w"][-1]
        np.testing.assert_allclose(found["theta"], theta, rtol=0, atol=1e-9 * np.abs(theta).max())
        np.testing.assert_allclose(found["w"], w, rtol=0, atol=1e-9)
        largest = records.steps["alpha_phi2"].reshape(episodes, -1).max(axis=1)
        np.testing.assert_allclose(found["gauges"], largest, rtol=1e-9)
        judged = [one["cost"] for one in found["costs"]]
        np.testing.assert_allclose(judged[0], records.evaluations["cost"][0], rtol=1e-9)


def test_two_episodes_are_those_of_the_library(tab):
    tab.click("One episode")
    tab.click("One episode")
    assert_equal_to_python(tab.shown(), 2)


def test_they_are_with_another_seed_decay_and_alpha(tab):
    tab.ask_otherwise()
    tab.click("One episode")
    assert_equal_to_python(tab.shown(), 1, **OTHERWISE)


def test_a_step_moves_both_learners_by_one(tab):
    tab.click("One step")
    tab.click("One step")
    shown = tab.shown()
    for found in shown["found"]:
        records = run(Experiment(learner=found["learner"], episodes=1))
        assert found["step"]["time"] == 1
        np.testing.assert_allclose(found["theta"], records.steps["theta"][1], rtol=1e-9)
        np.testing.assert_allclose(found["step"]["state"], records.steps["state"][1], atol=1e-9)


def test_it_trains_until_it_is_stopped_and_goes_on(tab):
    tab.click("Train")
    tab.page.wait_for_function(EPISODES, arg=[tab.figure.element_handle(), 2])
    tab.click("Stop")
    shown = tab.shown()
    tab.later()
    assert tab.shown() == shown
    found, records = shown["found"][0], run(Experiment(learner="ES", episodes=10))
    assert 10 <= found["episode"] < 300
    assert found["costs"][1]["cost"] == pytest.approx(records.evaluations["cost"][-1], rel=1e-6)
    assert tab.figure.locator("progress").evaluate("bar => bar.value") == found["episode"]
    tab.click("One episode")
    assert tab.shown()["found"][0]["episode"] == found["episode"] + 1
    tab.click("Reset all")
    assert tab.shown()["found"][0]["episode"] == 0


def test_the_gauge_says_so_above_two_and_not_by_colour_alone(tab):
    meter = tab.figure.get_by_role("meter").first
    tab.click("One step")
    assert float(meter.get_attribute("aria-valuetext")) < OVERSHOOT
    tab.press("alpha, step size of theta", "End")
    tab.click("One step")
    shown = tab.shown()
    number = shown["found"][0]["gauge"]
    assert number == pytest.approx(10 * 0.374, rel=0.01)
    assert meter.get_attribute("aria-valuetext") == f"{number:.2f}, overshoots"
    assert f"{number:.2f}, overshoots" in tab.figure.inner_text()


def test_a_screen_reader_is_given_the_costs(tab):
    tab.click("One episode")
    tab.quiet()
    said = tab.figure.get_by_role("status").inner_text()
    for found in tab.shown()["found"]:
        line = f"{found['learner']}: episode 1, step 130; cost without noise before training"
        assert f"{line} {found['costs'][0]['cost']:.1f}" in said


def test_with_reduced_motion_the_pictures_change_at_the_end_alone(opened):
    tab = opened(FIGURE, reduced_motion="reduce").begun()
    tab.figure.evaluate(PICTURES)
    tab.click("Train")
    tab.page.wait_for_function(
        "figure => figure.querySelector('progress').value >= 2", arg=tab.figure.element_handle()
    )
    assert tab.page.evaluate("window.changes") == 0
    tab.click("Stop")
    tab.shown()
    assert tab.page.evaluate("window.changes") > 0
