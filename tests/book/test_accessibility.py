"""The built book for everyone: WCAG 2.2 AA by axe, and what axe does not try, keys and edges."""

from dataclasses import dataclass, field

import pytest
from driver import project
from visits import EACH_PUSH, TELEPHONES, VIEWS, look_at, opened

PAGES = [*project.pages(), "search", "genindex"]  # the last two are Sphinx's
each_page = pytest.mark.parametrize("page", PAGES)


@each_page
def test_axe_finds_nothing(visit, page):
    assert visit(page).themes == [theme for _, theme in EACH_PUSH]
    assert visit(page).findings == []


@pytest.mark.weekly
@each_page
def test_axe_finds_nothing_in_any_other_width_and_theme(site, browser, page):
    others = {view: rules for view, rules in VIEWS.items() if view not in EACH_PUSH}
    found = look_at(browser, site / f"{page}.html", others)
    assert found.themes == [theme for _, theme in others]
    assert found.findings == []


@each_page
def test_no_page_scrolls_sideways_on_a_telephone(visit, page):
    assert visit(page).widths == list(TELEPHONES)


@each_page
def test_nothing_is_cut_off_formulas_take_no_focus_and_a_finger_hits_what_opens(visit, page):
    assert (visit(page).cut, visit(page).stops, visit(page).small) == ([], [], [])


CHAPTER = "book/04_ges"  # has all that opens, and formulas, tables and code that scroll
STOP = """() => {
  const one = document.activeElement;
  if (one === document.body) return null;
  const box = one.getBoundingClientRect(), style = getComputedStyle(one);
  const points = [0.02, 0.5, 0.98].flatMap(x => [0.1, 0.5, 0.9].map(
    y => document.elementFromPoint(box.x + x * box.width, box.y + y * box.height)));
  const outlined = style.outlineStyle !== "none" && parseFloat(style.outlineWidth) > 1;
  return {
    html: one.outerHTML.slice(0, 200),
    ring: outlined || style.boxShadow !== "none",
    seen: style.opacity === "1" && points.some(hit => hit?.contains(one) || one.contains(hit)),
    folded: one.matches(".bd-article summary"),
  };
}"""


@dataclass
class Walk:
    """Where the Tab key led, from the beginning of a chapter to its end."""

    folded: int = 0  # boxes of the chapter
    opened: int = 0  # of them, on the way
    stuck: list[str] = field(default_factory=list)  # what Enter and Space do not open and close
    lost: list[str] = field(default_factory=list)  # where one does not see the focus


@pytest.fixture(scope="session", params=[1400, 390])
def walk(site, browser, request) -> Walk:
    """Press Tab until the end, and Enter, Space and Enter on the way where something is folded."""
    tab = opened(browser, (site / f"{CHAPTER}.html").resolve().as_uri(), request.param)
    walk = Walk(folded=tab.locator(".bd-article details").count())
    tab.keyboard.press("Tab")
    while stop := tab.evaluate(STOP):
        if not (stop["ring"] and stop["seen"]):
            walk.lost.append(stop["html"])
        if stop["folded"]:
            states = []
            for key in ("Enter", "Space", "Enter"):
                tab.keyboard.press(key)
                states.append(tab.evaluate("document.activeElement.parentElement.open"))
            walk.opened += 1
            if states != [True, False, True]:
                walk.stuck.append(stop["html"])
        tab.keyboard.press("Tab")
    tab.close()
    return walk


def test_the_keyboard_opens_and_closes_all_that_is_folded(walk):
    assert walk.stuck == []
    assert walk.opened == walk.folded > 0


def test_the_keyboard_never_leads_out_of_sight(walk):
    assert walk.lost == []
