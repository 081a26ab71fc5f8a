"""A page of the built book, opened once from disk, and all that a browser finds on it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from axe_playwright_python.sync_playwright import Axe

WCAG = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
BRIEF = {"resultTypes": ["violations"], "preload": False}  # preloading would request the styles
EVERYTHING = {"runOnly": WCAG, "rules": {"target-size": {"enabled": True}}} | BRIEF
COLOURS = {"runOnly": ["color-contrast", "link-in-text-block"]} | BRIEF
Views = dict[tuple[int, str], dict[str, Any]]
VIEWS: Views = {  # every rule in both widths, and those of colours in both themes, too
    (1400, "light"): EVERYTHING,
    (1400, "dark"): COLOURS,
    (390, "dark"): EVERYTHING,
    (390, "light"): COLOURS,
}
EACH_PUSH = dict([*VIEWS.items()][:1])  # the others are looked at once a week
TELEPHONES = (390, 320)  # [px]
PATIENCE = 300_000  # ms until a page counts as stuck: a busy machine trains several times slower
UNREADABLE = "[data-mjx-error], mjx-container mtext[mathcolor=red]"  # errors, unknown macros

TYPESET = "window.MathJax?.startup?.promise"
BEGUN = """() => [...document.querySelectorAll("figure.live")]
  .every(one => one.querySelector("[role=status][aria-busy=false]"))"""
WIDTH = "document.documentElement.scrollWidth"
FIGURES_WIDTH = """Math.max(...[...document.querySelectorAll("figure.live")]
  .map(one => one.scrollWidth))"""
OPEN = "document.querySelectorAll('details').forEach(box => (box.open = true))"
SETTLED = """new Promise(done => {  // a browser may stop drawing
  requestAnimationFrame(() => requestAnimationFrame(done))
  setTimeout(done, 5000)
})"""
STILL = "*, ::before, ::after { transition: none !important; animation: none !important; }"

# A page repeats formulas, words of code and signatures by the thousand: the first of each kind
# stands for all.
THIN = """() => {
  const seen = new Set();
  const many = ":is(pre, code, dt.sig) span[class], mjx-container";
  for (const one of document.querySelectorAll(many)) {
    const within = one.closest("a, code, dt, pre")?.className;
    const kind = [one.className, one.getAttribute("display"), within].join();
    if (!seen.has(kind)) seen.add(kind);
    else if (one.matches("span")) one.replaceWith(...one.childNodes);
    else one.querySelectorAll("svg > *, math > *").forEach(part => part.remove());
  }
  document.body.normalize();
}"""

# In a view, text of one look stands for all text that has it: the same element and class in the
# same, in the same colour and size, above the same backgrounds.
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

LEFT = """[...document.querySelectorAll(".scrolls > *, .math > *")].filter(one =>
  one.getBoundingClientRect().left < one.parentElement.getBoundingClientRect().left - 1)"""

CUT = f"""() => {WIDE}
  .filter(([one, style]) => ["hidden", "clip"].includes(style.overflowX))
  .map(([one]) => one).concat({LEFT})
  .map(one => one.outerHTML.slice(0, 200))"""

STOPS = """() => [...document.querySelectorAll(".math, .math *")]
  .filter(one => one.tabIndex === 0 && !one.matches("a"))
  .map(one => one.outerHTML.slice(0, 200))"""

SMALL = """() => [...document.querySelectorAll(".bd-article :is(summary, button, .download a)")]
  .filter(one => one.checkVisibility())
  .filter(one => Math.min(one.offsetWidth, one.offsetHeight) < 24)
  .map(one => one.outerHTML.slice(0, 200))"""


@dataclass
class Visit:
    """What was found on a page: the beginnings of elements, but where something else is said."""

    requests: list[str] = field(default_factory=list)  # addresses
    errors: list[str] = field(default_factory=list)  # as the console has them
    formulas: int = 0  # that the page holds
    typeset: int = 0  # of them, by MathJax
    broken: list[str] = field(default_factory=list)  # those that MathJax could not read
    width: int = 0  # of the page on a telephone, as it opens [px]
    findings: list[str] = field(default_factory=list)  # of axe, a sentence each
    themes: list[str | None] = field(default_factory=list)  # in the order of the views
    widths: list[int] = field(default_factory=list)  # of the page on `TELEPHONES`, all open [px]
    cut: list[str] = field(default_factory=list)  # cannot scroll to all of it
    stops: list[str] = field(default_factory=list)  # a formula that takes the focus for nothing
    small: list[str] = field(default_factory=list)  # ours, and a finger may miss it


def opened(browser: Any, address: str, width: int) -> Any:
    """A page that does not move, with its formulas."""
    size = {"width": width, "height": 900}
    tab = browser.new_page(viewport=size, color_scheme="light", reduced_motion="reduce")
    tab.set_default_timeout(PATIENCE)
    tab.goto(address)
    tab.add_style_tag(content=STILL)
    tab.evaluate(TYPESET)
    return tab


def look_at(browser: Any, path: Path, views: Views) -> Visit:
    """What is found on a page: as it opens, with all open on telephones, and by axe in `views`."""
    seen = Visit()
    tab = browser.new_page(viewport={"width": TELEPHONES[0], "height": 900})
    tab.set_default_timeout(PATIENCE)
    tab.on("request", lambda request: seen.requests.append(request.url))
    tab.on("pageerror", lambda error: seen.errors.append(str(error)))
    tab.on("requestfailed", lambda request: seen.errors.append(f"failed: {request.url}"))
    tab.on("console", lambda said: seen.errors.append(said.text) if said.type == "error" else None)
    tab.goto(path.resolve().as_uri())
    tab.evaluate(TYPESET)
    seen.formulas = tab.locator("article .math").count()
    seen.typeset = tab.locator("article .math:has(mjx-container)").count()
    seen.broken = tab.locator(UNREADABLE).evaluate_all("all => all.map(one => one.outerHTML)")
    seen.width = tab.evaluate(WIDTH)
    tab.emulate_media(reduced_motion="reduce")
    tab.add_style_tag(content=STILL)
    tab.evaluate(OPEN)
    for width in TELEPHONES:
        tab.set_viewport_size({"width": width, "height": 900})
        tab.evaluate(SETTLED)
        seen.widths.append(tab.evaluate(WIDTH))
        seen.cut += tab.evaluate(CUT)
    seen.stops, seen.small = tab.evaluate(STOPS), tab.evaluate(SMALL)
    judge(tab, seen, views)
    tab.close()
    return seen


def judge(tab: Any, seen: Visit, views: Views) -> None:
    """Let axe look at a page in some widths and themes, its live figures begun."""
    tab.wait_for_function(BEGUN)
    tab.evaluate(THIN)
    tab.evaluate(Axe().axe_script)
    for (width, theme), rules in views.items():
        tab.set_viewport_size({"width": width, "height": 900})
        tab.emulate_media(color_scheme=theme)
        tab.evaluate(SETTLED)
        seen.themes.append(tab.evaluate("document.documentElement.dataset.theme"))
        tab.evaluate(FIRST_OF_EACH_LOOK)
        found = tab.evaluate("rules => axe.run(rules)", rules)
        seen.findings += [f"{width} {theme}: {one}" for one in sentences(found)]


def assert_figures_pass(tab: Any, width: int) -> None:
    """Axe finds nothing in the live figures of a page of this width, in either theme, nor too wide.

    Args:
        tab: of Playwright, with its figures in a state that no visit finds them in.
        width: one of `VIEWS`.
    """
    tab.add_style_tag(content=STILL)
    tab.evaluate(Axe().axe_script)
    for theme in ("light", "dark"):
        tab.emulate_media(color_scheme=theme)
        tab.evaluate(SETTLED)
        assert tab.evaluate("document.documentElement.dataset.theme") == theme
        found = tab.evaluate("rules => axe.run('figure.live', rules)", EVERYTHING)
        assert found["passes"]
        assert found["violations"] == []
        assert tab.evaluate(FIGURES_WIDTH) <= width


def sentences(found: dict[str, Any]) -> Iterator[str]:
    """What axe found, a sentence for each element."""
    for rule in found["violations"]:
        for node in rule["nodes"]:
            yield f"{rule['id']} at {node['target']}: {node['failureSummary']}"
