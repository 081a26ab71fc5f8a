"""The live figure of moving obstacles: places and velocities are dragged, two robots plan anew."""

import numpy as np
import pytest

from nmpcrl.analysis.encounters import judged
from nmpcrl.report.live.moving_obstacles import BEGIN, SCENE
from nmpcrl.study import moving, paper
from nmpcrl.study.moving import PERIOD, PREDICTORS, Straight

FIGURE = "moving"
TIME, MARGIN = "Time", "theta c, tightens the obstacle constraint"
STEP = "document.querySelector('figure.live').shown.given.step"
FAILS_AT_20 = """
  const real = WebAssembly.instantiate
  WebAssembly.instantiate = async (...given) => {
    const { instance } = await real(...given)
    const { task_cost, nmpc_solve } = instance.exports
    if (task_cost) return { instance }
    let calls = 0
    const solve = (...given) => {
      if (given[5] < 0) calls = 0 // without a warm start
      return ++calls > 20 ? 1 : nmpc_solve(...given)
    }
    return { instance: { exports: { ...instance.exports, nmpc_solve: solve } } }
  }"""


def assert_equal_to_python(shown: dict) -> None:
    given = shown["given"]
    motions = [Straight((x, y), (vx, vy)) for x, y, vx, vy in given["movers"]]
    for view, robot in shown["found"].items():
        around = moving.World(motions, PREDICTORS[view])
        found = judged(moving.controller(4), np.array(given["theta"]), around)
        assert not robot["failed"]
        assert robot["costs"][-1] == pytest.approx(found.cost, rel=1e-6)
        assert robot["inside"][-1] == found.contacts.inside
        np.testing.assert_allclose(robot["states"], found.states[: paper.STEPS], atol=1e-4)


def centre(mover: list, step: int) -> list:
    return [mover[a] + PERIOD * step * mover[2 + a] for a in (0, 1)]


def test_both_robots_drive_as_in_python(tab):
    shown = tab.shown()
    assert shown["given"]["step"] == BEGIN
    assert shown["given"]["movers"] == [[*one.centre, *one.velocity] for one in SCENE]
    assert_equal_to_python(shown)


def test_a_dragged_obstacle_is_there_at_the_time_shown_and_keeps_its_velocity(tab):
    before = tab.shown()
    scale = tab.figure.locator("svg").first.evaluate("svg => svg.getScreenCTM().a")
    tab.drag("Obstacle 2", (-60, 40))
    after = tab.shown()
    moved, old = after["given"]["movers"][1], before["given"]["movers"][1]
    assert moved[2:] == old[2:]
    way = np.array(centre(moved, BEGIN)) - centre(old, BEGIN)
    np.testing.assert_allclose(way, [-60 / scale, -40 / scale], atol=0.02)
    assert after["found"]["extrapolated"]["states"] != before["found"]["extrapolated"]["states"]
    assert_equal_to_python(after)


def test_the_tip_of_an_arrow_is_a_velocity_and_the_disc_stays(tab):
    before = tab.shown()["given"]["movers"]
    scale = tab.figure.locator("svg").first.evaluate("svg => svg.getScreenCTM().a")
    tab.drag("Obstacle 3, velocity", (4 * 0.2 * scale, 0))
    shown = tab.shown()
    mover = shown["given"]["movers"][2]
    assert mover[2:] == pytest.approx([0.2, 0.0], abs=0.011)
    np.testing.assert_allclose(centre(mover, BEGIN), before[2][:2])
    assert_equal_to_python(shown)
    tab.drag("Obstacle 3, velocity", (-4 * 0.2 * scale - 30, 0))  # onto the disc
    assert tab.shown()["given"]["movers"][2][2:] == [0, 0]
    assert tab.handle("Obstacle 3, velocity").get_attribute("aria-valuetext") == "stands"


def test_keys_move_places_and_velocities_and_the_margin(tab):
    tab.press("Obstacle 1, velocity", "ArrowDown", "ArrowRight")
    tab.press("Obstacle 4", "Shift+ArrowUp")
    tab.press(MARGIN, *["ArrowRight"] * 5)
    shown = tab.shown()
    given = shown["given"]
    assert given["movers"][0][2:] == pytest.approx([0.05, 0.25])
    assert given["movers"][3] == pytest.approx([7.5, -0.5, 0, 0])
    assert given["theta"][8] == pytest.approx(0.051)
    assert_equal_to_python(shown)


def test_a_shorter_arrow_on_the_left_makes_the_second_robot_the_cheaper_one(tab):
    tab.press("Obstacle 1, velocity", "ArrowDown")
    robots = tab.shown()["found"]
    assert robots["frozen"]["costs"][-1] < robots["extrapolated"]["costs"][-1]


def test_a_finger_drags_an_arrow(opened):
    tab = opened(FIGURE, viewport={"width": 390, "height": 844}, has_touch=True).begun()
    tab.see()
    tab.swipe(tab.middle("Obstacle 1, velocity"), (30, 0))
    vx, vy = tab.shown()["given"]["movers"][0][2:]
    assert vx > 0.15
    assert vy > 0.15
    assert_equal_to_python(tab.shown())


def test_no_obstacle_is_faster_than_a_metre_a_second(tab):
    tab.press("Obstacle 1, velocity", *["Shift+ArrowUp"] * 5)
    assert tab.shown()["given"]["movers"][0][2:] == [0, 1]


def test_obstacles_on_the_start_are_planned_around_as_in_python(tab):
    """There the best of several cold starts is another than the first."""
    tab.press(TIME, "Home")
    tab.press("Obstacle 1", *["Shift+ArrowLeft"] * 4, *["ArrowUp"] * 4)
    tab.press("Obstacle 1, velocity", "Shift+ArrowDown")
    assert tab.shown()["given"]["movers"][0] == pytest.approx([-1.5, 1.4, 0, 0.05])
    assert_equal_to_python(tab.shown())


def test_a_margin_keeps_the_second_robot_outside_and_it_still_pays(tab):
    tab.press(MARGIN, *["ArrowRight"] * 25)
    shown = tab.shown()
    robots = shown["found"]
    assert robots["frozen"]["inside"][-1] == 0
    assert robots["frozen"]["costs"][-1] > 1.3 * robots["extrapolated"]["costs"][-1]
    assert_equal_to_python(shown)


def test_time_moves_everything_but_solves_nothing_anew(tab):
    tab.see()
    before, place = tab.shown(), tab.middle("Obstacle 1")
    assert tab.figure.locator(".within").count() == 1
    tab.press(TIME, "Home")
    after = tab.shown()
    assert after["given"] == before["given"] | {"step": 0}
    assert after["found"] == before["found"]
    assert tab.middle("Obstacle 1")[1] > place[1] + 50
    assert tab.figure.locator(".within").count() == 0
    tab.quiet()
    costs = after["found"]["frozen"]["costs"]
    said = tab.figure.locator("[role=status]").inner_text()
    assert f"cost {costs[0]:.0f} so far, {costs[-1]:.0f} in all" in said


def test_it_plays_to_the_end_or_until_something_is_moved(tab):
    tab.press(TIME, "End", *["ArrowLeft"] * 8)
    tab.click("Play")
    tab.page.wait_for_function(f"{STEP} === 129")
    tab.figure.get_by_role("button", name="Play", exact=True).wait_for()
    tab.click("Play")  # from the start
    tab.page.wait_for_function(f"{STEP} > 2 && {STEP} < 60")
    tab.press("Obstacle 4", "ArrowUp")
    assert tab.figure.get_by_role("button", name="Play", exact=True).count() == 1
    step = tab.later().shown()["given"]["step"]
    assert 2 < step < 129
    assert tab.later().shown()["given"]["step"] == step


def test_reset_restores_the_beginning_in_every_digit(tab):
    before = tab.shown()
    tab.drag("Obstacle 1, velocity", (20, 40))
    tab.press(TIME, "Home")
    assert tab.shown() != before
    tab.click("Reset all")
    assert tab.shown() == before


def test_a_robot_without_a_plan_says_where_it_ends(opened):
    tab = opened(FIGURE, script=FAILS_AT_20).begun()
    said = "the solver found no plan at step 20, and the episode ends there."
    assert tab.figure.locator("[role=status]").inner_text().count(said) == 2
    assert len(tab.shown()["found"]["frozen"]["states"]) == 20
