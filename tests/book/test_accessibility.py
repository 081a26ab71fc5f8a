"""The built book for everyone: WCAG 2.2 AA by axe, and what axe does not try, keys and edges.

A page is opened once, from disk, with all that is folded open.
"""

import functools
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import build
import pytest
from axe_playwright_python.sync_playwright import Axe

pytestmark = pytest.mark.book

PAGES = [*build.pages(), "search", "genindex", "prf-prf"]  # the last three are Sphinx's
WCAG = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
BRIEF = {"resultTypes": ["violations"], "preload": False}  # preloading would request the styles
EVERYTHING = {"runOnly": WCAG, "rules": {"target-size": {"enabled": True}}} | BRIEF
COLOURS = {"runOnly": ["color-contrast", "link-in-text-block"]} | BRIEF
VIEWS = {  # every rule in both widths, and those of colours in both themes, too
    (1400, "light"): EVERYTHING,
    (1400, "dark"): COLOURS,
    (390, "dark"): EVERYTHING,
    (390, "light"): COLOURS,
}
TELEPHONES = (390, 320)  # [px]

OPEN = "document.querySelectorAll('details').forEach(box => (box.open = true))"
SETTLED = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
STILL = "*, ::before, ::after { transition: none !important; animation: none !important; }"

# A page repeats formulas and words of code by the thousand: the first of each kind stands for all.
THIN = """() => {
  const seen = new Set();
  for (const one of document.querySelectorAll("pre span[class], mjx-container")) {
    const kind = one.className + one.getAttribute("display");
    if (!seen.has(kind)) seen.add(kind);
    else if (one.matches("span")) one.replaceWith(...one.childNodes);
    else one.querySelectorAll("svg > *, math > *").forEach(part => part.remove());
  }
  document.body.normalize();
}"""

# After the first view, text of one look stands for all text that has it: the same element and class
# in the same, in the same colour and size, above the same backgrounds.
FIRST_OF_EACH_LOOK = """() => {
  const beneath = new Map([[null, ""]]), seen = new Set();
  for (const one of document.querySelectorAll("*")) {
    const style = getComputedStyle(one), parent = one.parentElement;
    const own = [style.backgroundColor, style.backgroundImage, style.opacity, style.position];
    const plain = own.join() === "rgba(0, 0, 0, 0),none,1,static";
    beneath.set(one, beneath.get(parent) + (plain ? "" : own.join()));
    delete one.dataset.first;
    const said = [...one.childNodes].some(node => node.nodeType === 3 && node.data.trim());
    if (!said || !one.checkVisibility({ visibilityProperty: true })) continue;
    const look = [one.localName, one.className, parent.localName, parent.className, style.color,
      style.fontSize, style.fontWeight, style.textShadow, beneath.get(one)].join();
    if (!seen.has(look)) one.dataset.first = "";
    seen.add(look);
  }
  axe.configure({ rules: [{ id: "color-contrast", selector: "[data-first]" }] });
}"""

# Elements of the article wider than their place, but not what is only heard (MathML) or drawn.
WIDE = """[...document.querySelectorAll(".bd-article *")]
  .filter(one => one.clientWidth > 1 && one.scrollWidth > one.clientWidth + 1)
  .filter(one => !one.closest("mjx-assistive-mml, svg"))
  .map(one => [one, getComputedStyle(one)])"""

CUT = f"""() => {WIDE}
  .filter(([one, style]) => ["hidden", "clip"].includes(style.overflowX))
  .map(([one]) => one.outerHTML.slice(0, 200))"""

SILENT = f"""() => {WIDE}
  .filter(([one, style]) => ["auto", "scroll"].includes(style.overflowX) && !one.matches("a"))
  .filter(([one, style]) => one.tabIndex || !one.role || !one.ariaLabel
    || !style.boxShadow.includes("inset"))
  .map(([one]) => one.outerHTML.slice(0, 200))"""

STOPS = """() => [...document.querySelectorAll(".math, .math *")]
  .filter(one => one.tabIndex === 0 && !one.matches("[data-more], a"))
  .map(one => one.outerHTML.slice(0, 200))"""

SMALL = """() => [...document.querySelectorAll(".bd-article :is(summary, button, .download a)")]
  .filter(one => Math.min(one.offsetWidth, one.offsetHeight) < 24)
  .map(one => one.outerHTML.slice(0, 200))"""

NAMELESS = """() => [...document.querySelectorAll(".bd-article .scrolls[data-more]")].flatMap(box => {
  if (box.querySelector("th[rowspan]")) return [];  // names in two columns
  box.scrollLeft = box.scrollWidth;
  const { left } = box.getBoundingClientRect();
  const away = [...box.querySelectorAll("tbody tr > th:first-child")].filter(one => {
    const name = one.getBoundingClientRect();
    return Math.abs(name.left - left) > 2 || name.width > box.clientWidth / 2;
  });
  box.scrollLeft = 0;
  return away.map(one => one.outerHTML.slice(0, 200));
})"""  # noqa: E501

each_page = pytest.mark.parametrize("page", PAGES)


@dataclass
class Visit:
    """What was found on a page: the beginnings of elements, but where something else is said."""

    findings: list[str] = field(default_factory=list)  # of axe, a sentence each
    themes: list[str | None] = field(default_factory=list)  # in the order of `VIEWS`
    widths: dict[int, int] = field(default_factory=dict)  # of the page by that of the screen [px]
    cut: list[str] = field(default_factory=list)  # is wider than its place and cannot scroll
    silent: list[str] = field(default_factory=list)  # scrolls without focus, name or shadow
    nameless: list[str] = field(default_factory=list)  # a row's name that scrolls away or hides it
    stops: list[str] = field(default_factory=list)  # a formula that takes the focus for nothing
    small: list[str] = field(default_factory=list)  # ours, and a finger may miss it


def opened(browser: Any, address: str, width: int) -> Any:
    """A page that does not move, with its formulas."""
    size = {"width": width, "height": 900}
    tab = browser.new_page(viewport=size, color_scheme="light", reduced_motion="reduce")
    tab.goto(address)
    tab.add_style_tag(content=STILL)
    tab.evaluate("window.MathJax?.startup?.promise")
    return tab


@pytest.fixture(scope="session")
def visit(site, browser):
    """Open a page of the site once a session, and look at it in every width and theme."""
    return functools.cache(lambda page: look_at(browser, site / f"{page}.html"))


def look_at(browser: Any, path: Path) -> Visit:
    """What is found on a page."""
    seen = Visit()
    tab = opened(browser, path.resolve().as_uri(), TELEPHONES[0])
    tab.evaluate(OPEN)
    for width in TELEPHONES:
        tab.set_viewport_size({"width": width, "height": 900})
        tab.evaluate(SETTLED)
        seen.widths[width] = tab.evaluate("document.documentElement.scrollWidth")
        seen.cut += tab.evaluate(CUT)
        seen.silent += tab.evaluate(SILENT)
        seen.nameless += tab.evaluate(NAMELESS)
    seen.stops, seen.small = tab.evaluate(STOPS), tab.evaluate(SMALL)
    tab.evaluate(THIN)
    tab.evaluate(Axe().axe_script)
    for number, ((width, theme), rules) in enumerate(VIEWS.items()):
        tab.set_viewport_size({"width": width, "height": 900})
        tab.emulate_media(color_scheme=theme)
        tab.evaluate(SETTLED)
        seen.themes.append(tab.evaluate("document.documentElement.dataset.theme"))
        if number:
            tab.evaluate(FIRST_OF_EACH_LOOK)
        found = tab.evaluate("rules => axe.run(rules)", rules)
        seen.findings += [f"{width} {theme}: {one}" for one in sentences(found)]
    tab.close()
    return seen


def sentences(found: dict[str, Any]) -> Iterator[str]:
    """What axe found, a sentence for each element."""
    for rule in found["violations"]:
        for node in rule["nodes"]:
            yield f"{rule['id']} at {node['target']}: {node['failureSummary']}"


@each_page
def test_axe_finds_nothing(visit, page):
    assert visit(page).themes == [theme for _, theme in VIEWS]
    assert visit(page).findings == []


FAINT = """<!doctype html><html lang="en" data-theme="light"><head><title>Faint</title><style>
body { background: #fff; color: #000 }
a { color: inherit }
@media (prefers-color-scheme: dark) { body { background: #000; color: #fff } }
@media WHERE { .other { color: #888; background: #999 } }
</style></head><body><main><h1>Words</h1>
<p>one</p><p>two</p><p style="color: inherit">three</p><p class="other">four</p><p>five</p>
<p><a href="#a">six</a></p><ul><li class="other">seven</li><li class="other">eight</li></ul>
</main></body></html>"""


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize(("width", "where"), [(1400, "min-width: 900px"), (390, "width: 390px")])
def test_axe_finds_what_is_faint_in_one_width_and_theme_alone(
    browser, tmp_path, width, where, theme
):
    """Once among the whole text, else once for each look."""
    page = tmp_path / "faint.html"
    page.write_text(FAINT.replace("WHERE", f"({where}) and (prefers-color-scheme: {theme})"))
    found = [one for one in look_at(browser, page).findings if "color-contrast" in one]
    whole = (width, theme) == next(iter(VIEWS))
    assert len(found) == (3 if whole else 2)
    assert all(one.startswith(f"{width} {theme}: ") for one in found)


@each_page
def test_no_page_scrolls_sideways_on_a_telephone(visit, page):
    assert visit(page).widths == {width: width for width in TELEPHONES}


@each_page
def test_nothing_is_cut_off(visit, page):
    assert visit(page).cut == []


@each_page
def test_what_scrolls_has_the_focus_a_name_and_a_shadow(visit, page):
    assert visit(page).silent == []


@each_page
def test_the_names_of_rows_stay_in_sight_while_a_table_scrolls(visit, page):
    assert visit(page).nameless == []


@each_page
def test_a_formula_takes_the_focus_only_to_scroll(visit, page):
    assert visit(page).stops == []


@each_page
def test_what_opens_or_copies_is_large_enough_for_a_finger(visit, page):
    assert visit(page).small == []


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
    ring: outlined || style.boxShadow !== "none" && !one.matches("[data-more]"),
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
