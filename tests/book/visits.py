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
STILL = "*, ::before, ::after { transition: none !important; animation: none !important; }"
SCRIPT = Path(__file__).with_name("visits.js")


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
    tab.add_script_tag(content=SCRIPT.read_text())
    tab.evaluate(TYPESET)
    seen.formulas = tab.locator("article .math").count()
    seen.typeset = tab.locator("article .math:has(mjx-container)").count()
    seen.broken = tab.locator(UNREADABLE).evaluate_all("all => all.map(one => one.outerHTML)")
    seen.width = tab.evaluate("visit.width()")
    tab.emulate_media(reduced_motion="reduce")
    tab.add_style_tag(content=STILL)
    tab.evaluate("visit.open()")
    for width in TELEPHONES:
        tab.set_viewport_size({"width": width, "height": 900})
        tab.evaluate("visit.settled()")
        seen.widths.append(tab.evaluate("visit.width()"))
        seen.cut += tab.evaluate("visit.cut()")
    seen.stops, seen.small = tab.evaluate("visit.stops()"), tab.evaluate("visit.small()")
    judge(tab, seen, views)
    tab.close()
    return seen


def judge(tab: Any, seen: Visit, views: Views) -> None:
    """Let axe look at a page in some widths and themes, its live figures begun."""
    tab.wait_for_function("visit.begun()")
    tab.evaluate("visit.thin()")
    tab.evaluate(Axe().axe_script)
    for (width, theme), rules in views.items():
        tab.set_viewport_size({"width": width, "height": 900})
        tab.emulate_media(color_scheme=theme)
        tab.evaluate("visit.settled()")
        seen.themes.append(tab.evaluate("document.documentElement.dataset.theme"))
        tab.evaluate("visit.firstOfEachLook()")
        found = tab.evaluate("rules => axe.run(rules)", rules)
        seen.findings += [f"{width} {theme}: {one}" for one in sentences(found)]


def assert_figures_pass(tab: Any, width: int) -> None:
    """Axe finds nothing in the live figures of a page of this width, in either theme, nor too wide.

    Args:
        tab: of Playwright, with its figures in a state that no visit finds them in.
        width: one of `VIEWS`.
    """
    tab.add_style_tag(content=STILL)
    tab.add_script_tag(content=SCRIPT.read_text())
    tab.evaluate(Axe().axe_script)
    for theme in ("light", "dark"):
        tab.emulate_media(color_scheme=theme)
        tab.evaluate("visit.settled()")
        assert tab.evaluate("document.documentElement.dataset.theme") == theme
        found = tab.evaluate("rules => axe.run('figure.live', rules)", EVERYTHING)
        assert found["passes"]
        assert found["violations"] == []
        assert tab.evaluate("visit.figuresWidth()") <= width


def sentences(found: dict[str, Any]) -> Iterator[str]:
    """What axe found, a sentence for each element."""
    for rule in found["violations"]:
        for node in rule["nodes"]:
            yield f"{rule['id']} at {node['target']}: {node['failureSummary']}"
