"""Chapter 2's live figure of one update: every number is Python's, and too large a step is seen."""

import numpy as np
import pytest

from nmpcrl.learning import semi_gradient_step, td_error
from nmpcrl.study import paper

FIGURE = "update"
ALPHA, SPEED, TURN = (
    "alpha, step size",
    "epsilon v, noise of the speed",
    "epsilon nu, noise of the turn rate",
)
NMPC = paper.nmpc("A")


def by_python(given: dict) -> dict:
    """The same update, under the figure's names."""
    state, theta = np.array(given["state"]), np.array(given["theta"])
    plan = NMPC.solve(state, theta)
    action = NMPC.plant.clip(plan.action + given["noise"])
    cost, following = NMPC.task.stage_cost(state, action), NMPC.plant.step(state, action)
    after = NMPC.solve(following, theta, plan)
    delta = td_error(cost, NMPC.gamma, plan.value, after.value)
    moved = semi_gradient_step(theta, delta, plan.features, given["alpha"])
    again = NMPC.solve(state, moved)
    return {
        "action": action,
        "cost": cost,
        "next": following,
        "delta": delta,
        "moved": moved,
        "pull": given["alpha"] * plan.features @ plan.features,
        "closed": (again.value - plan.value) / delta,
    }


def assert_equal_to_python(shown: dict) -> None:
    for name, number in by_python(shown["given"]).items():
        np.testing.assert_allclose(shown["found"][name], number, rtol=1e-6, atol=1e-8, err_msg=name)


def test_the_page_finds_what_python_finds(tab):
    shown = tab.shown()
    assert shown["given"]["alpha"] == paper.ALPHA
    assert shown["given"]["noise"] == [0, 0]
    assert_equal_to_python(shown)


def test_noise_is_added_and_clipped(tab):
    tab.press(SPEED, "Home")
    tab.press(TURN, "ArrowRight", "ArrowRight", "ArrowRight")
    shown = tab.shown()
    assert shown["given"]["noise"] == pytest.approx([-2, 0.3])
    assert shown["found"]["action"][0] == NMPC.plant.lower[0]
    assert_equal_to_python(shown)


def test_noise_can_be_drawn(tab):
    tab.click("Draw noise")
    first = tab.shown()
    tab.click("Draw noise")
    second = tab.shown()
    assert [0, 0] != first["given"]["noise"] != second["given"]["noise"]
    assert_equal_to_python(second)


def test_going_on_takes_the_new_theta_to_the_next_state(tab):
    for _ in range(3):
        before = tab.shown()["found"]
        tab.click("Apply, go on to s\u207a")
        shown = tab.shown()
        assert shown["given"]["state"] == before["next"]
        assert shown["given"]["theta"] == before["moved"]
    assert_equal_to_python(shown)


def test_the_share_follows_alpha_and_above_2_the_figure_says_so(tab):
    gauge, says = tab.figure.locator(".scale"), tab.figure.locator(".results")
    assert gauge.get_attribute("data-over") == "false"
    assert "overshoots" not in says.inner_text()
    tab.press(ALPHA, *["ArrowRight"] * 20)
    shown = tab.shown()
    assert shown["given"]["alpha"] == pytest.approx(1e-6)
    assert shown["found"]["pull"] > 2
    assert shown["found"]["closed"] > 2
    assert gauge.get_attribute("data-over") == "true"
    assert "overshoots" in says.inner_text()
    assert_equal_to_python(shown)
    tab.press(ALPHA, "Home")
    shown = tab.shown()
    assert shown["found"]["closed"] == pytest.approx(shown["found"]["pull"], rel=0.01)


def test_it_says_the_numbers_in_the_order_of_the_algorithm(tab):
    found, lines = tab.shown()["found"], tab.figure.locator(".steps li")
    for k, number in enumerate(
        (found["plan"]["value"], None, found["cost"], found["following"]["value"], found["delta"])
    ):
        assert number is None or f"{number:.3f}" in lines.nth(k).inner_text()


def test_reset_restores_the_beginning(tab):
    begin = tab.shown()
    tab.press(ALPHA, "ArrowRight")
    tab.click("Draw noise")
    tab.click("Reset all")
    assert tab.shown() == begin
