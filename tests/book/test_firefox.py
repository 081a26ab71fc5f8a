"""The live figures in Firefox: the same numbers, moved by pointer, keys and sliders."""

import json
from typing import Any

import firefox
import numpy as np
import pytest
from live_page import CHAPTERS, FRAMES
from live_python import assert_equal_to_python

from nmpcrl.analysis.two_state import Chain, follow
from nmpcrl.learning.learners import gradient_td
from nmpcrl.study import Experiment, run

MIDDLE = """(figure, name) => {
  const handle = figure.querySelector(`[aria-label="${name}"]`)
  handle.closest("svg, label").scrollIntoView({block: "center"})
  const { x, y, width, height } = (handle.querySelector(".reach") ?? handle).getBoundingClientRect()
  return [x + width / 2, y + height / 2]
}"""
FOCUS = """(figure, name) => figure.querySelector(`[aria-label="${name}"]`).focus()"""


BUTTON = """(figure, name) => {
  const button = [...figure.querySelectorAll("button")].find(one => one.textContent === name)
  button.scrollIntoView({block: "center"})
  const { x, y, width, height } = button.getBoundingClientRect()
  return [x + width / 2, y + height / 2]
}"""
SOON = """(figure, is) => new Promise((done, fail) => {
  const end = performance.now() + 50000
  const look = () => is(figure) ? done() : performance.now() < end ? setTimeout(look, 50) : fail("late")
  look()
})"""  # noqa: E501


class Reader:
    """Somebody at the live figure of a page."""

    def __init__(self, page: firefox.Page, figure: str) -> None:
        self.page, self.figure = page, f"figure.live[data-figure={figure}]"
        self.wait("figure => figure.shown")

    def ask(self, function: str, *arguments) -> Any:
        """What a function of the figure gives."""
        given = ", ".join(map(json.dumps, arguments))
        figure = f"document.querySelector('{self.figure}')"
        return self.page.evaluate(f"() => ({function})({figure}, {given})")

    def wait(self, condition: str) -> None:
        """Until a condition on the figure holds."""
        self.ask(f"figure => ({SOON})(figure, {condition})")

    def shown(self) -> dict:
        """What was asked and found, once it is drawn."""
        return self.ask(FRAMES)

    def middle(self, name: str) -> np.ndarray:
        """Where a handle is in the window, which scrolls there."""
        return np.array(self.ask(MIDDLE, name))

    def click(self, button: str) -> "Reader":
        self.page.click(self.ask(BUTTON, button))
        return self

    def drag(self, name: str, by: tuple[int, int]) -> None:
        place = self.middle(name)
        self.page.drag(place, place + by)

    def press(self, name: str, *keys: str) -> None:
        self.ask(FOCUS, name)
        self.page.press(*keys)


@pytest.fixture
def opened(site, distributed_firefox):
    """Opens the page of a live figure; at the end it has had no errors and asked nobody."""
    pages = []

    def open_page(figure: str, fragment: str = "", **size: int) -> Reader:
        url = (site / f"book/{CHAPTERS[figure]}.html").resolve().as_uri() + fragment
        pages.append(distributed_firefox.page(url, **size))
        return Reader(pages[-1], figure)

    yield open_page
    for page in pages:
        assert page.errors == []
        assert [url for url in page.requests if not url.startswith(("file:", "data:"))] == []
        page.close()


def test_the_controller_is_that_of_python_after_every_kind_of_change(opened):
    reader = opened("controller")
    assert_equal_to_python(reader.shown())
    reader.drag("Obstacle 2", (20, -35))
    reader.drag("Robot, heading", (-20, 30))
    reader.press("Obstacle 4", "ArrowLeft", "Shift+ArrowDown")
    reader.press("theta c, tightens the obstacle constraint", *["ArrowRight"] * 7)
    shown = reader.shown()
    given = shown["given"]
    assert given["discs"][3][:2] == pytest.approx([6.9, -0.2])
    assert given["theta"][8] == pytest.approx(0.071)
    assert_equal_to_python(shown)


def test_an_obstacle_follows_the_mouse_and_a_click(opened):
    reader = opened("controller")
    before, place = reader.shown()["given"]["discs"], reader.middle("Obstacle 2")
    reader.drag("Obstacle 2", (40, -30))
    reader.shown()  # what was moved is drawn with the next frame
    np.testing.assert_allclose(reader.middle("Obstacle 2"), place + [40, -30], atol=1)
    goal = place + [40, 60]
    reader.page.click(goal)
    reader.shown()
    np.testing.assert_allclose(reader.middle("Obstacle 2"), goal, atol=1)
    after = reader.shown()["given"]["discs"]
    assert [k for k in range(4) if after[k] != before[k]] == [1]


def test_the_chain_is_that_of_the_library(opened):
    reader = opened("chain")
    reader.press("beta, step size of w", "Home")
    shown = reader.click("Step").shown()
    assert shown["given"]["at"] == 1
    expected = follow(Chain(gamma=0.97), gradient_td(0.1, 0.01, 0.97), 120)
    theta = [now["theta"] for now in shown["found"]["GES"]]
    np.testing.assert_allclose(theta, expected[:, 0], rtol=1e-9)


def test_an_episode_of_es_and_ges_is_that_of_the_library(opened):
    shown = opened("learners").click("One episode").shown()
    for found in shown["found"]:
        theta = run(Experiment(learner=found["learner"], episodes=1)).steps["theta"][-1]
        np.testing.assert_allclose(found["theta"], theta, rtol=0, atol=1e-9 * theta.max())


def test_a_network_is_fitted_as_in_the_library(opened):
    reader = opened("networks").click("One episode")
    shown = reader.click("One episode").shown()
    for found in shown["found"]:
        theta = run(Experiment(learner=found["learner"], episodes=2)).steps["theta"][-1]
        np.testing.assert_allclose(found["theta"], theta, rtol=0, atol=1e-5 * theta.max())


def test_a_layout_that_is_drawn_in_the_laboratory_is_trained_there_as_in_the_library(opened):
    reader = opened("laboratory", "#learner=GES&episodes=1")  # more of them are chaotic in some
    before = reader.shown()["given"]["layout"]
    reader.drag("Obstacle 2", (40, -30))
    reader.click("Train").wait("figure => figure.shown.runs[0]?.state === 'finished'")
    shown = reader.shown()
    layout = tuple(map(tuple, shown["given"]["layout"]))
    assert [k for k in range(4) if list(layout[k]) != before[k]] == [1]
    steps = run(Experiment("GES", episodes=1, layout=layout)).steps
    theta = shown["runs"][0]["rows"][-1]["theta"]
    np.testing.assert_allclose(theta, steps["theta"][-1], rtol=0, atol=1e-9 * np.max(theta))


def test_it_trains_until_it_is_stopped(opened):
    reader = opened("learners").click("Train")
    reader.wait("figure => figure.querySelector('progress').value >= 1")
    shown = reader.click("Stop").shown()
    assert shown["found"][0]["episode"] >= 1
    assert reader.shown() == shown


def test_it_fits_a_narrow_window(opened):
    reader = opened("controller", width=500, height=800)
    assert reader.page.evaluate("() => document.documentElement.scrollWidth") <= 500
    assert not reader.shown()["found"]["failed"]
