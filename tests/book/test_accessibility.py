"""The built book for everyone: WCAG 2.2 AA by axe in all views, and what axe does not try: keys."""

import pytest
from driver import project
from visits import EACH_PUSH, VIEWS, look_at, opened


@pytest.mark.weekly
@pytest.mark.parametrize("page", [*project.pages(), "search", "genindex"])
def test_axe_finds_nothing_in_any_other_width_and_theme(site, browser, page):
    others = {view: rules for view, rules in VIEWS.items() if view not in EACH_PUSH}
    found = look_at(browser, site / f"{page}.html", others)
    assert found.themes == [theme for _, theme in others]
    assert found.findings == []


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


@pytest.mark.parametrize("width", [1400, 390])
def test_the_keyboard_opens_and_closes_all_that_is_folded_and_never_leads_out_of_sight(
    site, browser, width
):
    """Tab until the end; Enter, Space and Enter on the way where something is folded."""
    tab = opened(browser, (site / f"{CHAPTER}.html").resolve().as_uri(), width)
    folded, states, lost = tab.locator(".bd-article details").count(), [], []
    tab.keyboard.press("Tab")
    while stop := tab.evaluate(STOP):
        if not (stop["ring"] and stop["seen"]):
            lost.append(stop["html"])
        if stop["folded"]:
            for key in ("Enter", "Space", "Enter"):
                tab.keyboard.press(key)
                states.append(tab.evaluate("document.activeElement.parentElement.open"))
        tab.keyboard.press("Tab")
    tab.close()
    assert lost == []
    assert states == [True, False, True] * folded != []
