"""The live figures: what the driver does for them, and what a reader can do with them."""

import json
from pathlib import Path

import nbformat
import numpy as np
import pytest
from driver.page import live
from live_python import assert_equal_to_python

from nmpcrl.study import paper

FIGURE = "controller"
COVERED = """slider => {
  const { x, y, width, height } = slider.getBoundingClientRect()
  const hits = [0.05, 0.5, 0.95].map(share => document.elementFromPoint(x + share * width, y + height / 2))
  return hits.filter(hit => hit !== slider).map(hit => hit?.outerHTML.slice(0, 80))
}"""  # noqa: E501
FAILS_AT_20 = """
  const real = WebAssembly.instantiate
  WebAssembly.instantiate = async (...given) => {
    const { instance } = await real(...given)
    let calls = 0
    const solve = (...given) => ++calls > 150 ? 1 : instance.exports.nmpc_solve(...given)
    return { instance: { exports: { ...instance.exports, nmpc_solve: solve } } }
  }"""  # the first closed loop, which stays as a dotted line, takes 130 of them


def figure_of(*texts: str) -> nbformat.NotebookNode:
    """A notebook whose only cell displayed these files inline."""
    names = ("live.css", "solver.js")
    kinds = ("style", "script")
    inline = [
        f'<{kind} data-file="{name}">\n{text}\n</{kind}>'
        for kind, name, text in zip(kinds, names, texts, strict=True)
    ]
    output = nbformat.v4.new_output("display_data", {"text/html": "\n".join(inline)})
    return nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("x", outputs=[output])])


def test_what_is_inline_becomes_a_link_to_a_file(tmp_path):
    notebook = figure_of("p { margin: 0 }", 'run("\\d")')
    live.share(notebook, Path("book/01.ipynb"), tmp_path)
    assert notebook.cells[0].outputs[0].data["text/html"] == (
        '<link rel="stylesheet" href="../_static/live/live.css">\n'
        '<script src="../_static/live/solver.js"></script>'
    )
    assert (tmp_path / "solver.js").read_text() == 'run("\\d")'


def test_two_pages_share_a_file_only_if_it_is_the_same(tmp_path):
    for _ in range(2):
        live.share(figure_of("a", "b"), Path("book/01.ipynb"), tmp_path)
    with pytest.raises(ValueError, match=r"another solver\.js than the one"):
        live.share(figure_of("a", "c"), Path("book/02.ipynb"), tmp_path)


def test_the_page_finds_what_python_finds(tab):
    shown = tab.shown()
    assert shown["given"]["theta"] == list(paper.THETA_INIT)
    assert_equal_to_python(shown)


def test_it_finds_what_python_finds_after_every_kind_of_change(tab):
    tab.drag("Obstacle 2", (20, -35))
    tab.drag("Robot, start", (60, 90))
    tab.drag("Robot, heading", (-20, 30))
    tab.press(
        "theta x, weight of the distance in x at each planned step", "ArrowRight", "ArrowRight"
    )
    tab.press("theta c, tightens the obstacle constraint", *["ArrowRight"] * 7)
    tab.press("N, steps planned", "ArrowRight", "ArrowRight", "ArrowRight")
    shown = tab.shown()
    given = shown["given"]
    assert given["horizon"] == 13
    assert given["theta"][0] == pytest.approx(1.1)
    assert given["theta"][8] == pytest.approx(0.071)
    assert_equal_to_python(shown)


def test_an_obstacle_follows_the_mouse_and_the_trajectory_avoids_it(tab):
    before, place = tab.shown(), tab.middle("Obstacle 1")
    tab.drag("Obstacle 1", (40, 30))
    after = tab.shown()
    tab.see()
    assert tab.page.evaluate("document.activeElement.ariaLabel") == "Obstacle 1"
    assert after["given"]["discs"][1:] == before["given"]["discs"][1:]
    (x, y, _), (old_x, old_y, _) = after["given"]["discs"][0], before["given"]["discs"][0]
    assert x > old_x
    assert y < old_y
    assert (tab.middle("Obstacle 1") - place)[0] == pytest.approx(40, abs=1)
    assert after["found"]["states"] != before["found"]["states"]
    away = np.linalg.norm(np.array(after["found"]["states"])[:, :2] - [x, y], axis=1)
    assert away.min() > 1.2


def test_a_finger_drags_as_the_mouse_does(opened):
    tab = opened(FIGURE, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    tab.begun()
    tab.see()
    before = tab.shown()["given"]["discs"][2]
    tab.swipe(tab.middle("Obstacle 3"), (0, 30), steps=10)
    after = tab.shown()["given"]["discs"][2]
    assert after[1] < before[1] - 0.9
    assert after[0] == pytest.approx(before[0], abs=0.05)


@pytest.mark.parametrize(("by", "moves"), [((0, -160), False), ((3, 160), False), ((-45, 2), True)])
def test_a_swipe_from_a_slider_scrolls_the_page_or_moves_the_slider(opened, by, moves):
    tab = opened(FIGURE, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    slider = tab.begun().figure.locator("input[type=range]").nth(5)
    slider.evaluate("one => one.scrollIntoView({block: 'center'})")
    before, box = tab.shown(), slider.bounding_box()
    track = (box["x"] + 0.8 * box["width"], box["y"] + box["height"] / 2)  # off the thumb
    tab.swipe(track, by, steps=8)
    after = tab.later().shown()  # a browser scrolls on for a while
    assert (after["given"]["theta"][5] != before["given"]["theta"][5]) == moves
    assert (after["given"] == before["given"]) != moves
    assert (abs(slider.bounding_box()["y"] - box["y"]) > 50) != moves


def test_nothing_lies_on_the_sliders_on_a_telephone(opened):
    tab = opened(FIGURE, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    for slider in tab.begun().figure.locator("input[type=range]").all():
        for height in (400, 762):  # scroll up, to where the theme has its button
            slider.evaluate("(one, y) => scrollBy(0, one.getBoundingClientRect().y - y)", height)
            tab.later(6)
        assert slider.evaluate(COVERED) == []


def test_the_keyboard_reaches_and_moves_every_handle(tab):
    tab.handle("Obstacle 1").focus()
    names = []
    for _ in range(6):
        names.append(tab.page.evaluate("document.activeElement.ariaLabel"))
        tab.page.keyboard.press("ArrowUp")
        tab.page.keyboard.press("Tab")
    assert names == [*(f"Obstacle {k}" for k in range(1, 5)), "Robot, start", "Robot, heading"]
    shown, task = tab.shown(), paper.task("A")
    centres = [[one.x, one.y + 0.1] for one in task.obstacles]
    np.testing.assert_allclose([disc[:2] for disc in shown["given"]["discs"]], centres)
    np.testing.assert_allclose(shown["given"]["start"], task.start + [0, 0.1, np.pi / 36])
    assert_equal_to_python(shown)


def test_shift_makes_larger_steps_and_the_page_does_not_scroll(tab):
    tab.see()
    scrolled = tab.page.evaluate("scrollY")
    tab.press("Obstacle 4", "ArrowLeft", "Shift+ArrowDown")
    x, y, _ = tab.shown()["given"]["discs"][3]
    assert [x, y] == pytest.approx([6.9, -0.2])
    assert tab.page.evaluate("scrollY") == scrolled
    assert tab.handle("Obstacle 4").get_attribute("aria-valuetext") == "x 6.90 m, y \u22120.20 m"


def test_a_click_moves_what_was_clicked_before(tab):
    tab.see()
    tab.page.mouse.click(*tab.middle("Obstacle 2"))
    goal = tab.middle("Obstacle 2") + [0, 90]
    tab.page.mouse.click(*goal)
    moved = tab.shown()
    np.testing.assert_allclose(tab.middle("Obstacle 2"), goal, atol=1)
    tab.page.locator("figure.live").get_by_role("button", name="Reset all").focus()
    tab.page.mouse.click(*(goal + [0, 20]))  # now nothing is chosen
    assert tab.shown() == moved


def test_nothing_leaves_the_map_and_the_robot_stays_in_its_box(tab):
    tab.press("Robot, start", *["Shift+ArrowLeft"] * 4)
    tab.press("Obstacle 3", *["Shift+ArrowUp"] * 20)
    given = tab.shown()["given"]
    data = json.loads(tab.figure.locator("script[type]").text_content())
    assert given["start"][0] == paper.LOWER[0]
    assert given["discs"][2][1] == pytest.approx(data["view"][1] + data["view"][3])


@pytest.mark.parametrize("k", range(9))
def test_each_slider_moves_its_own_component_of_theta(tab, k):
    slider = tab.figure.locator("input[type=range]").nth(k)
    slider.focus()
    tab.page.keyboard.press("ArrowRight")
    moved = np.array(tab.shown()["given"]["theta"]) - paper.THETA_INIT
    assert np.flatnonzero(moved).tolist() == [k]
    assert moved[k] > 0


def test_reset_restores_the_beginning_in_every_digit(tab):
    before = tab.shown()
    tab.drag("Robot, start", (30, 60))
    tab.press("N, steps planned", "ArrowLeft")
    assert tab.shown() != before
    tab.click("Reset all")
    assert tab.shown() == before


def test_a_screen_reader_is_told_the_results_once_nothing_changes(tab):
    status = tab.figure.locator("[role=status]")
    tab.press("Obstacle 2", "Shift+ArrowUp")
    found = tab.shown()["found"]
    assert status.get_attribute("aria-busy") == "true"
    tab.quiet()
    for number in (found["plan"]["value"], found["cost"], found["parts"]["stages"]):
        assert f"{number:.1f}" in status.inner_text()


def test_a_loop_that_ends_early_says_so(opened):
    tab = opened(FIGURE, script=FAILS_AT_20)
    tab.begun()
    said = "The solver found no plan at step 20; the closed loop ends there."
    assert tab.figure.locator("[role=status]").inner_text().strip() == said
    assert len(tab.shown()["found"]["states"]) == 20
