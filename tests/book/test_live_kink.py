"""Chapter 2's live figure of the kink: the robot walks over a boundary, and the slope jumps."""

import numpy as np
import pytest

from nmpcrl.study import paper

FIGURE = "kink"
WALK = "d, distance of the robot from the nearest boundary, negative inside"
NMPC, THETA = paper.nmpc("A"), np.array(paper.THETA_INIT)


def overlap(shown: dict) -> float:
    """Xi + theta_c of the nearest obstacle."""
    return NMPC.task.overlap(shown["given"]["start"]).max() + THETA[8]


def assert_equal_to_python(shown: dict) -> None:
    plan = NMPC.solve(np.array(shown["given"]["start"]), THETA)
    assert shown["found"]["plan"]["value"] == pytest.approx(plan.value, rel=1e-9)
    assert shown["found"]["plan"]["features"][8] == pytest.approx(plan.features[8], abs=1e-4)


def test_the_slope_jumps_by_the_weight_of_the_slack(tab):
    assert tab.shown()["found"]["jump"] == pytest.approx(NMPC.slack_weight, abs=0.1)
    tab.drag("Robot, start", (-60, -30))  # to another place
    assert tab.shown()["found"]["jump"] == pytest.approx(NMPC.slack_weight, abs=1)


def test_the_slider_walks_from_inside_to_outside(tab):
    seen = {}
    for key in ("Home", "End"):
        tab.press(WALK, key)
        shown = tab.shown()
        assert_equal_to_python(shown)
        seen[key] = shown
    assert overlap(seen["Home"]) > 0 > overlap(seen["End"])
    offsets = [seen[key]["found"]["boundary"]["offset"] for key in ("Home", "End")]
    assert offsets == pytest.approx([-0.1, 0.1])
    slack = seen["Home"]["found"]["plan"]["slack"]
    assert slack >= overlap(seen["Home"]) - 1e-6


def test_one_step_of_the_slider_over_the_boundary_shows_the_jump(tab):
    tab.press(WALK, "End", *["ArrowLeft"] * 19)
    outside = tab.shown()
    tab.press(WALK, "ArrowLeft", "ArrowLeft")
    inside = tab.shown()
    assert overlap(outside) < 0 < overlap(inside)
    slopes = [shown["found"]["plan"]["features"][8] for shown in (outside, inside)]
    assert slopes[1] - slopes[0] > 0.9 * NMPC.slack_weight
    assert "5.0 mm inside" in tab.figure.locator(".results").inner_text()


def test_the_robot_is_walked_over_by_hand_and_by_keys(tab):
    tab.press("Robot, start", "ArrowUp")  # towards the obstacle's middle
    inside = tab.shown()
    assert overlap(inside) > 0
    assert_equal_to_python(inside)
    tab.drag("Robot, start", (0, 60))
    outside = tab.shown()
    assert overlap(outside) < 0
    assert_equal_to_python(outside)


def test_the_curves_are_those_of_python(tab):
    found = tab.shown()["found"]
    heading = tab.shown()["given"]["start"][2]
    (x, y), out, radius = (found["boundary"][name] for name in ("centre", "out", "radius"))
    for place in (*found["inside"][::8], *found["outside"][::8]):
        reach = radius + place["offset"]
        plan = NMPC.solve(np.array([x + reach * out[0], y + reach * out[1], heading]), THETA)
        assert place["value"] == pytest.approx(plan.value, rel=1e-9)
        assert place["slope"] == pytest.approx(plan.features[8], abs=1e-4)


def test_reset_restores_the_beginning(tab):
    begin = tab.shown()
    tab.press(WALK, "Home")
    tab.click("Reset")
    assert tab.shown() == begin
