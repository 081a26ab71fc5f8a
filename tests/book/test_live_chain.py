"""The live figure of the chain: its updates are the library's, and a reader goes through them."""

import numpy as np
import pytest
from visits import assert_figures_pass

from nmpcrl.analysis.two_state import FIRST, SECOND, Chain, follow, sampled_step
from nmpcrl.learning import Weights
from nmpcrl.learning.learners import gradient_td, semi_gradient

FIGURE = "chain"
ALPHA, BETA, GAMMA = "alpha, step size of theta", "beta, step size of w", "gamma, discount"
UPDATES = "Updates made"
MOVES = """figure => {
  window.changes = 0
  new MutationObserver(all => window.changes += all.length)
    .observe(figure, {subtree: true, childList: true, attributes: true})
}"""
AT = "([figure, at]) => figure.shown.given.at >= at"


def rules(given: dict) -> dict:
    alpha, beta, gamma = given["alpha"], given["beta"], given["gamma"]
    return {"ES": semi_gradient(alpha), "GES": gradient_td(alpha, beta, gamma)}


def in_turn(chain: Chain, rule, updates: int) -> np.ndarray:
    """(theta, w) when the states take turns."""
    weights, path = Weights(np.array([1.0]), np.array([0.0])), []
    for k in range(updates + 1):
        path.append([weights.theta[0], weights.w[0]])
        weights = sampled_step(chain, rule, weights, (FIRST, SECOND)[k % 2])
    return np.array(path)


def path_of(shown: dict, learner: str) -> np.ndarray:
    return np.array([[now["theta"], now["w"]] for now in shown["found"][learner]])


def test_the_updates_are_those_of_the_library(tab):
    shown = tab.shown()
    assert shown["given"] == pytest.approx(
        {"alpha": 0.1, "beta": 0.4, "gamma": 0.97, "states": "first", "at": 0}
    )
    for learner, rule in rules(shown["given"]).items():
        expected = follow(Chain(gamma=0.97), rule, 120)
        np.testing.assert_allclose(path_of(shown, learner), expected, rtol=1e-9)
    assert abs(shown["found"]["ES"][-1]["theta"]) > 1e4
    assert abs(shown["found"]["GES"][-1]["theta"]) < 1e-6


def test_they_are_after_every_kind_of_change(tab):
    tab.press(ALPHA, "ArrowRight", "ArrowRight")
    tab.press(BETA, *["ArrowLeft"] * 3)
    tab.press(GAMMA, "ArrowLeft")
    tab.figure.get_by_label("in both states in turn (on-policy)").check()
    shown = tab.shown()
    given = shown["given"]
    assert [given[name] for name in ("alpha", "beta", "gamma")] == [0.12, 0.37, 0.96]
    assert given["states"] == "both"
    for learner, rule in rules(given).items():
        expected = in_turn(Chain(gamma=0.96), rule, 120)
        np.testing.assert_allclose(path_of(shown, learner), expected, rtol=1e-9, atol=1e-300)
    assert abs(shown["found"]["ES"][-1]["theta"]) < 1


def test_with_too_small_a_beta_gradient_td_diverges_too(tab):
    tab.press(BETA, "Home")
    assert abs(tab.shown()["found"]["GES"][-1]["theta"]) > 1e3


def test_a_step_a_key_and_play_move_through_the_updates(tab):
    tab.click("Step")
    assert tab.shown()["given"]["at"] == 1
    tab.press(UPDATES, "ArrowRight", "ArrowRight")
    assert tab.shown()["given"]["at"] == 3
    tab.press(UPDATES, "End", "ArrowLeft", "ArrowLeft")
    tab.click("Play")
    tab.page.wait_for_function(AT, arg=[tab.figure.element_handle(), 120])
    tab.figure.get_by_role("button", name="Play").wait_for()
    tab.click("Reset all")
    assert tab.shown()["given"]["at"] == 0


def test_nothing_moves_before_play_or_after_pause(tab):
    tab.quiet().figure.evaluate(MOVES)
    tab.later()
    assert tab.page.evaluate("window.changes") == 0
    tab.click("Play")
    tab.page.wait_for_function(AT, arg=[tab.figure.element_handle(), 2])
    tab.click("Pause")
    at = tab.shown()["given"]["at"]
    tab.later()
    assert tab.shown()["given"]["at"] == at < 120


def test_a_screen_reader_is_given_the_numbers_of_the_update(tab):
    tab.click("Step")
    tab.quiet()
    now = tab.shown()["found"]["GES"][1]
    said = tab.figure.get_by_role("status").inner_text()
    for number in (now["theta"], now["w"], now["delta"]):
        assert f"{number:.3f}" in said
    slider = tab.handle(UPDATES)
    assert slider.get_attribute("aria-valuetext") == "after 1 update"


def test_with_reduced_motion_there_are_steps_and_a_slider_alone(opened):
    tab = opened(FIGURE, reduced_motion="reduce").begun()
    assert not tab.figure.get_by_role("button", name="Play").is_visible()
    tab.click("Step")
    assert tab.shown()["given"]["at"] == 1


@pytest.mark.parametrize("width", [390, 1400])
def test_axe_finds_nothing_in_the_chapters_figures(opened, width):
    size = {"width": width, "height": 900}
    tab = opened(FIGURE, formulas=True, viewport=size, has_touch=width < 400).begun()
    tab.click("Step")
    tab.page.wait_for_function(
        "[...document.querySelectorAll('figure.live [role=status]')]"
        ".map(one => one.ariaBusy).join() === 'false,false'"
    )
    assert_figures_pass(tab.page, width)
    for target in tab.page.locator(
        "figure.live :is(button, select, input:not([type=radio]))"
    ).all():
        box = target.bounding_box()
        assert min(box["width"], box["height"]) >= 24
