"""The introduction's live figure: the robot plans anew, learns, and fails where a gap is narrow."""

import json

import numpy as np
import pytest

from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.claims import published
from nmpcrl.control import Obstacle
from nmpcrl.control.task import Task
from nmpcrl.learning.rollout import evaluate
from nmpcrl.report.live.introduction import NARROW, WIDE
from nmpcrl.study import Experiment, paper

FIGURE = "intro"
TELEPHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
LEARNED = """() => {
  const { given } = document.querySelector("figure.live").shown
  return !given.learning && given.episode === 300
}"""
GOING = """() => {
  const { learning, episode } = document.querySelector('figure.live').shown.given;
  return learning && episode > 2;
}"""
RESTING = "() => !document.querySelector('figure.live').shown.given.learning"
TOP = "document.querySelector('figure.live svg').getBoundingClientRect()"


def task_of(given: dict) -> Task:
    centres = [Obstacle(x, y) for x, y, _ in given["discs"]]
    return Task(**vars(paper.task(WIDE)) | {"obstacles": tuple(centres)})


def by_python(given: dict):
    """The trajectory without noise of what is asked."""
    nmpc = paper.controller(task_of(given))
    return evaluate(nmpc, np.array(given["theta"]), paper.STEPS)


def assert_equal_to_python(shown: dict) -> None:
    now, found = shown["found"]["now"], by_python(shown["given"])
    assert now["cost"] == pytest.approx(found.cost, rel=1e-6)
    np.testing.assert_allclose(now["states"], found.states, atol=1e-4)


def learn(tab) -> dict:
    tab.click("Learn")
    tab.page.wait_for_function(LEARNED)
    return tab.shown()


def status(tab) -> str:
    return tab.quiet().figure.locator("[role=status]").inner_text()


def centres(shown: dict) -> list[list[float]]:
    return [disc[:2] for disc in shown["given"]["discs"]]


def published_run(layout: str) -> dict:
    return published.load().rows[Experiment(learner="ES", layout=layout)]


def test_it_begins_with_the_study_and_with_what_python_finds(tab):
    shown = tab.shown()
    assert centres(shown) == [list(one) for one in paper.LAYOUTS[WIDE]]
    assert shown["given"]["theta"] == list(paper.THETA_INIT)
    assert shown["found"]["now"]["arrived"]
    assert shown["found"]["now"]["cost"] == pytest.approx(published_run(WIDE)["initial_cost"])
    assert_equal_to_python(shown)
    assert "Before learning, the robot arrives" in status(tab)


def test_an_obstacle_that_is_dragged_changes_the_trajectory_at_once(tab):
    before = tab.shown()
    tab.drag("Obstacle 2", (0, -60))
    after = tab.shown()
    assert centres(after)[1][1] > centres(before)[1][1] + 0.5
    assert after["found"]["now"]["states"] != before["found"]["now"]["states"]
    assert_equal_to_python(after)
    assert not after["given"]["learning"]


def test_learning_ends_where_the_published_run_does_and_the_cost_falls(tab):
    before, after = tab.shown(), learn(tab)
    run = published_run(WIDE)
    assert after["given"]["theta"][8] == pytest.approx(run["theta_8"], rel=1e-3)
    assert after["found"]["now"]["cost"] == pytest.approx(run["final_cost"], rel=0.01)
    assert after["found"]["now"]["cost"] < before["found"]["now"]["cost"]
    assert after["found"]["first"]["cost"] == before["found"]["now"]["cost"]
    assert after["found"]["now"]["arrived"]
    assert_equal_to_python(after)
    said = status(tab)
    assert "After 300 episodes: the robot arrives" in said
    assert f"% less than before learning ({before['found']['now']['cost']:.0f})" in said


def test_where_learning_closes_the_gap_it_fails_and_widening_goes_back(tab):
    begin = tab.shown()
    tab.click("Narrow a gap")
    closed = tab.shown()
    assert centres(closed) == [list(one) for one in paper.LAYOUTS[NARROW]]
    assert closed["found"]["now"]["arrived"]
    after = learn(tab)
    first = by_python(closed["given"])
    assert after["given"]["theta"][8] > closes_at(task_of(closed["given"]), first.states[:, :2])
    assert not after["found"]["now"]["arrived"]
    assert published_run(NARROW)["ending"] == "stuck"
    assert after["found"]["now"]["cost"] > 1.2 * closed["found"]["now"]["cost"]
    assert "is stuck before the target" in status(tab)
    assert "% more than before learning" in status(tab)
    tab.click("Widen it again")
    assert tab.shown() == begin


def test_learning_is_seen_while_it_goes_on_and_stops_at_a_click_or_a_move(tab):
    tab.click("Learn")
    tab.page.wait_for_function(GOING)
    assert tab.figure.locator("progress").is_visible()
    assert tab.figure.locator(".before").get_attribute("points")
    tab.click("Stop")
    stopped = tab.shown()["given"]["episode"]
    assert not tab.later().shown()["given"]["learning"]
    assert tab.shown()["given"]["episode"] == stopped < 300
    tab.click("Learn")
    tab.page.wait_for_function(GOING)
    tab.press("Obstacle 1", "ArrowUp")
    tab.page.wait_for_function(RESTING)
    moved = tab.later().shown()["given"]
    assert moved["moved"]
    assert moved["theta"] != list(paper.THETA_INIT)
    assert "and moved since: the robot" in status(tab)


def test_the_dashed_circles_are_what_plans_keep(tab):
    shown = learn(tab)
    radius = float(tab.figure.locator("circle.kept").first.get_attribute("r"))
    *_, clearance = shown["given"]["discs"][0]
    assert radius == pytest.approx(clearance / 2 * (1 + shown["given"]["theta"][8]) ** 0.5)
    assert radius > clearance / 2


def test_the_keyboard_learns_and_moves(tab):
    tab.figure.get_by_role("button", name="Learn").focus()
    tab.page.keyboard.press("Tab")
    tab.page.keyboard.press("Enter")
    assert centres(tab.shown()) == [list(one) for one in paper.LAYOUTS[NARROW]]
    tab.page.keyboard.press("Tab")
    assert tab.page.evaluate("document.activeElement.ariaLabel") == "Obstacle 1"
    tab.page.keyboard.press("Shift+ArrowUp")
    assert centres(tab.shown())[0] == pytest.approx([0.6, 3.9])
    assert_equal_to_python(tab.shown())


def test_a_finger_drags_an_obstacle_and_the_whole_map_is_on_the_first_screen(opened):
    tab = opened(FIGURE, **TELEPHONE).begun()
    assert tab.page.evaluate(f"{TOP}.bottom") < 844
    before = tab.shown()
    tab.swipe(tab.middle("Obstacle 2"), (0, -30), steps=10)
    after = tab.shown()
    assert centres(after)[1][1] > centres(before)[1][1] + 0.5
    assert after["found"]["now"]["states"] != before["found"]["now"]["states"]


@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_the_robot_is_on_the_first_screen_and_its_picture_is_not(opened, size):
    width, height = size
    tab = opened(FIGURE, viewport={"width": width, "height": height}).begun()
    assert tab.page.evaluate(f"{TOP}.bottom") < height
    assert not tab.page.locator("article img").first.is_visible()
    tab.page.emulate_media(media="print")
    assert tab.page.locator("article img").first.is_visible()


def test_a_worker_that_does_not_start_is_said(opened):
    tab = opened(
        FIGURE,
        script="window.Worker = class { constructor() { setTimeout(() => "
        "this.onerror({ message: '' })) } postMessage() {} terminate() {} }",
    ).begun()
    tab.click("Learn")
    tab.figure.get_by_text("This browser could not train: it did not start a worker.").wait_for()
    assert not tab.shown()["given"]["learning"]


def test_the_page_is_given_the_settings_of_the_study(tab):
    data = json.loads(tab.figure.locator("script[type]").text_content())
    assert data["settings"]["learner"] == "ES"
    assert data["settings"]["episodes"] == paper.EPISODES
