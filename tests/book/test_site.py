"""The built book: whole, without a dead link or an external request, and for everyone."""

import functools
import re
from urllib.parse import unquote, urldefrag, urlsplit

import pytest
from bs4 import BeautifulSoup
from driver import project
from driver.build.render import MOVED
from visits import EACH_PUSH, TELEPHONES

PAGES = project.pages()
WRONG = ("errors", "broken", "findings", "cut", "stops", "small")  # of a `Visit`
LOADED = {  # what a browser fetches by itself
    "script": "src",
    "img": "src",
    "iframe": "src",
    "source": "src",
    "link": "href",
}

each_page = pytest.mark.parametrize("page", PAGES)


@pytest.fixture(scope="session")
def anchors(html):
    """All that a link can lead to on a page, by path."""
    return functools.cache(
        lambda path: {one.get(a) for one in html(path).find_all() for a in ("id", "name")}
    )


@each_page
def test_no_image_link_or_anchor_leads_nowhere(site, html, anchors, page):
    here = site / f"{page}.html"
    for element in html(f"{page}.html").find_all(["a", *LOADED]):
        address = element.get(LOADED.get(element.name, "href"), "")
        path, anchor = urldefrag(address)
        if not address or urlsplit(address).scheme or "=" in urldefrag(address).fragment:
            continue  # the last one sets the laboratory
        target = (here.parent / unquote(urlsplit(path).path)).resolve() if path else here
        assert target.exists(), address
        if anchor and target.suffix == ".html":
            there = anchors(str(target.relative_to(site.resolve())))
            assert there & {unquote(anchor), anchor}, address


@each_page
def test_a_page_has_a_heading_and_no_reference_is_left_unresolved(html, page):
    assert html(f"{page}.html").find("h1")
    article = BeautifulSoup(str(html(f"{page}.html").find("article")), "html.parser")
    assert not article.select(".problematic, .system-message")
    for unread in article.select("pre, code, script, style, .math"):
        unread.extract()
    text = article.get_text(" ")
    assert "??" not in text
    assert "undefined" not in text
    assert not re.search(
        r"\b(eq|fig|ch|alg|ex|departure):[a-z]|\{(ref|eq|numref|cite|glue)\b", text
    )


@pytest.mark.parametrize("page", [*PAGES, "search", "genindex"])  # the last two are Sphinx's
def test_a_page_opened_from_disk_is_whole_and_for_everyone(visit, page):
    """No request to a network, no error, no sideways scrolling, nothing that axe would say."""
    found = visit(page)
    wrong = {name: getattr(found, name) for name in WRONG if getattr(found, name)}
    wrong["requests"] = [one for one in found.requests if not one.startswith(("file:", "data:"))]
    assert {name: one for name, one in wrong.items() if one} == {}
    assert found.typeset == found.formulas
    assert found.formulas or not re.search(r"/0\d_", page)
    assert (found.width <= TELEPHONES[0], found.widths) == (True, list(TELEPHONES))
    assert found.themes == [theme for _, theme in EACH_PUSH]


def test_the_search_finds_expected_sarsa_from_disk(site, browser):
    tab = browser.new_page()
    tab.goto(f"{site.resolve().as_uri()}/search.html?q=Expected+Sarsa")
    tab.locator("#search-results li a[href*='02_expected_sarsa.html']").first.wait_for()
    tab.close()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("index.html", f"{PAGES[0]}.html"),
        *((f"{old}.html", new) for old, new in MOVED.items()),
        ("book/for_reviewers.html#reviewers-rule", "evidence.html#evidence-rule"),
        ("book/for_reviewers.html#reviewers-wrong", "evidence.html#evidence-failed"),
        ("book/reproducibility.html#reproducibility-since", "evidence.html#evidence-since"),
        ("book/why_learning_stops.html#why-drawn", "06_why_learning_stops.html#why-drawn"),
    ],
)
def test_the_entry_and_old_addresses_open_a_page_or_a_place_on_it(old, new, site, browser):
    tab = browser.new_page()
    tab.goto(f"{site.resolve().as_uri()}/{old}")
    tab.wait_for_url(f"**/{new}")
    anchor = new.partition("#")[2]
    assert not anchor or tab.locator(f"[id='{anchor}']").count() == 1
    tab.close()
