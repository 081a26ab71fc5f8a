"""The live figures in Firefox: the same numbers, moved by pointer, keys and sliders."""

import firefox
import numpy as np
import pytest
from live_page import CHAPTERS, FRAMES
from live_python import assert_equal_to_python

pytestmark = pytest.mark.book

MIDDLE = """name => {
  const handle = document.querySelector(`figure.live [aria-label="${name}"]`)
  handle.closest("svg, label").scrollIntoView({block: "center"})
  const { x, y, width, height } = (handle.querySelector(".reach") ?? handle).getBoundingClientRect()
  return [x + width / 2, y + height / 2]
}"""
FOCUS = """name => document.querySelector(`figure.live [aria-label="${name}"]`).focus()"""


class Reader:
    """Somebody at the live figure of a page."""

    def __init__(self, page: firefox.Page, figure: str) -> None:
        self.page, self.figure = page, f"figure.live[data-figure={figure}]"

    def shown(self) -> dict:
        """What was asked and found, once it is drawn."""
        return self.page.evaluate(f"() => ({FRAMES})(document.querySelector('{self.figure}'))")

    def middle(self, name: str) -> np.ndarray:
        """Where a handle is in the window, which scrolls there."""
        return np.array(self.page.evaluate(MIDDLE, name))

    def drag(self, name: str, by: tuple[int, int]) -> None:
        place = self.middle(name)
        self.page.drag(place, place + by)

    def press(self, name: str, *keys: str) -> None:
        self.page.evaluate(FOCUS, name)
        self.page.press(*keys)


@pytest.fixture
def opened(site, distributed_firefox):
    """Opens the page of a live figure; at the end it has had no errors and asked nobody."""
    pages = []

    def open_page(figure: str, **size: int) -> Reader:
        url = (site / f"book/{CHAPTERS[figure]}.html").resolve().as_uri()
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
    np.testing.assert_allclose(reader.middle("Obstacle 2"), place + [40, -30], atol=1)
    goal = place + [40, 60]
    reader.page.click(goal)
    np.testing.assert_allclose(reader.middle("Obstacle 2"), goal, atol=1)
    after = reader.shown()["given"]["discs"]
    assert [k for k in range(4) if after[k] != before[k]] == [1]


def test_it_fits_a_narrow_window(opened):
    reader = opened("controller", width=500, height=800)
    assert reader.page.evaluate("() => document.documentElement.scrollWidth") <= 500
    assert not reader.shown()["found"]["failed"]
