"""Chapter 2's live figure of the gradient: the envelope theorem and differences, as in Python."""

from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.control import Obstacle
from nmpcrl.study import paper

FIGURE = "gradient"
CURVES = "figure => new Promise(done => {{ {} }})".format(
    "const look = () => figure.shown.found.all ? done(figure.shown.found.all)"
    " : setTimeout(look, 20); look()"
)
STEP = "h, step of the finite differences"


def by_python(given: dict, h: float):
    """The envelope gradient, and central and forward differences with a step."""
    obstacles = tuple(Obstacle(x, y) for x, y, _ in given["discs"])
    nmpc = paper.controller(replace(paper.task("A"), obstacles=obstacles))
    state, theta = np.array(given["start"]), np.array(given["theta"])
    moved = [theta + sign * h * row for row in np.eye(9) for sign in (1, -1)]
    above, below = np.array([nmpc.solve(state, row).value for row in moved]).reshape(9, 2).T
    plan = nmpc.solve(state, theta)
    return plan.features, (above - below) / (2 * h), (above - plan.value) / h


def assert_equal_to_python(shown: dict) -> None:
    chosen = shown["found"]["chosen"]
    features, central, forward = by_python(shown["given"], chosen["step"])
    np.testing.assert_allclose(shown["found"]["plan"]["features"], features, rtol=1e-7, atol=1e-7)
    noise = 1e-8 / chosen["step"]  # two solvers' values agree to so much
    np.testing.assert_allclose(chosen["central"], central, atol=noise)
    np.testing.assert_allclose(chosen["forward"], forward, atol=noise)


def test_the_page_finds_what_python_finds(tab):
    assert_equal_to_python(tab.shown())


def test_it_does_so_after_every_kind_of_change(tab):
    tab.drag("Robot, start", (25, -12))
    tab.drag("Obstacle 2", (-10, 15))
    tab.press("Robot, heading", "ArrowUp")
    tab.press("theta y, weight of the distance in y at each planned step", "ArrowRight")
    tab.press(STEP, *["ArrowRight"] * 3)
    shown = tab.shown()
    assert shown["given"]["theta"][1] == pytest.approx(1.05)
    assert shown["found"]["chosen"]["step"] == pytest.approx(10**-3.5)
    assert_equal_to_python(shown)


def test_both_errors_fall_with_the_step_and_grow_again(tab):
    all_steps = tab.figure.evaluate(CURVES)
    for kind in ("central", "forward"):
        errors = [each["errors"][kind] for each in all_steps]
        best = int(np.argmin(errors))
        assert errors[0] > 5 * errors[best] < errors[-1]  # round-off, truncation
    least = [min(each["errors"][kind] for each in all_steps) for kind in ("central", "forward")]
    assert least[0] < least[1]  # down to the accuracy of the envelope gradient itself


def test_the_bars_are_logarithmic_and_have_their_numbers(tab):
    found = tab.shown()["found"]
    rows = tab.figure.locator(".component").all()
    assert len(rows) == 9
    for row, *numbers in zip(
        rows, found["plan"]["features"], found["chosen"]["central"], strict=True
    ):
        whole = row.locator(".pair").bounding_box()["width"]
        for bar, number in zip(row.locator("i").all(), numbers, strict=True):
            share = (np.log10(number) + 2) / 6
            assert bar.bounding_box()["width"] == pytest.approx(share * whole, abs=1)
        assert row.locator(".numbers").inner_text() == " | ".join(f"{each:.3f}" for each in numbers)


def test_on_a_boundary_the_two_gradients_differ_in_theta_c(tab):
    given = tab.shown()["given"]
    x, y, clearance = given["discs"][0]
    tab.press("Robot, start", "ArrowUp", "ArrowUp", "ArrowUp")
    tab.press(STEP, "End")  # the difference then reaches over the boundary
    shown = tab.shown()
    away = np.hypot(shown["given"]["start"][0] - x, shown["given"]["start"][1] - y)
    assert 0.9 < away / (clearance / 2) < 1
    found = shown["found"]
    assert abs(found["plan"]["features"][8] - found["chosen"]["central"][8]) > 5
    assert_equal_to_python(shown)


def test_the_results_name_the_step_and_both_errors(tab):
    tab.press(STEP, "End")
    errors = tab.shown()["found"]["chosen"]["errors"]
    said = tab.figure.locator(".results").inner_text()
    assert "h = 10\u207b\u00b9" in said
    assert f"{errors['forward'] * 100:.1f} · 10\u207b\u00b2" in said


def test_another_step_does_not_solve_the_curves_again(tab):
    tab.figure.evaluate(CURVES)
    tab.figure.evaluate("figure => { figure.known = figure.shown.found.all }")
    tab.press(STEP, "ArrowLeft")
    tab.shown()
    assert tab.figure.evaluate("figure => figure.known === figure.shown.found.all")
    tab.press("Robot, start", "ArrowUp")
    tab.shown()  # a slow machine may have solved the new ones by now
    assert tab.figure.evaluate("figure => figure.known !== figure.shown.found.all")


def test_reset_restores_the_beginning(tab):
    begin = tab.shown()["given"]
    tab.press("Obstacle 1", "ArrowDown")
    tab.press(STEP, "ArrowLeft")
    assert tab.shown()["given"] != begin
    tab.click("Reset all")
    assert tab.shown()["given"] == begin
