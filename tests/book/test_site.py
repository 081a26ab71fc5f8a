"""The built book: whole, without a dead link or an external request, readable on a phone."""

import functools
import http.server
import re
import threading
from urllib.parse import unquote, urldefrag, urlsplit

import pytest
from bs4 import BeautifulSoup
from driver import project
from driver.build.render import MOVED

PAGES = project.pages()
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
def test_every_entry_of_the_table_of_contents_is_a_page_with_a_heading(html, page):
    assert html(f"{page}.html").find("h1")


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
def test_no_reference_is_left_unresolved(html, page):
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


@each_page
def test_every_image_has_alt_text(html, page):
    images = html(f"{page}.html").find("article").find_all("img")
    assert [image["src"] for image in images if not image.get("alt", "").strip()] == []


@each_page
def test_nothing_on_a_page_names_another_host(html, page):
    for element in html(f"{page}.html").find_all(list(LOADED)):
        assert not urlsplit(element.get(LOADED[element.name], "")).netloc


def test_no_style_names_another_host(site):
    for sheet in site.rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*['\"]?(https?:)?//", sheet.read_text()), sheet


@each_page
def test_a_page_opened_from_disk_requests_nothing_from_a_network(visit, page):
    assert [url for url in visit(page).requests if not url.startswith(("file:", "data:"))] == []


@each_page
def test_a_page_logs_no_error(visit, page):
    assert visit(page).errors == []


@each_page
def test_every_formula_is_typeset(visit, page):
    assert visit(page).broken == []
    assert visit(page).typeset == visit(page).formulas


def test_the_chapters_hold_formulas(visit):
    assert all(visit(page).formulas for page in PAGES if re.search(r"/0\d_", page))


@each_page
def test_a_page_is_no_wider_than_a_telephone(visit, page):
    assert visit(page).width <= 390


def found(browser, address: str) -> list[str]:
    """The addresses that a search for Expected Sarsa lists."""
    tab = browser.new_page()
    tab.goto(f"{address}/search.html?q=Expected+Sarsa")
    tab.wait_for_selector("#search-results li a")
    links = tab.locator("#search-results li a").evaluate_all("all => all.map(one => one.href)")
    tab.close()
    return links


def test_the_search_finds_expected_sarsa_from_disk(site, browser):
    assert any("02_expected_sarsa.html" in link for link in found(browser, site.resolve().as_uri()))


def test_the_search_finds_expected_sarsa_on_a_server(site, browser):
    quiet = type("Quiet", (http.server.SimpleHTTPRequestHandler,), {"log_message": lambda *_: None})
    handler = functools.partial(quiet, directory=site)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        links = found(browser, f"http://127.0.0.1:{server.server_port}")
        server.shutdown()
    assert any("02_expected_sarsa.html" in link for link in links)


@pytest.mark.parametrize(("old", "new"), [("index", f"{PAGES[0]}.html"), *MOVED.items()])
def test_the_entry_and_old_addresses_open_a_page(old, new, site, browser):
    tab = browser.new_page()
    tab.goto((site / f"{old}.html").resolve().as_uri())
    tab.wait_for_url(f"**/{new}")
    anchor = new.partition("#")[2]
    assert not anchor or tab.locator(f"#{anchor}").count() == 1
    tab.close()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("for_reviewers.html#reviewers-rule", "evidence.html#evidence-rule"),
        ("for_reviewers.html#reviewers-wrong", "evidence.html#evidence-failed"),
        ("reproducibility.html#reproducibility-since", "evidence.html#evidence-since"),
        ("why_learning_stops.html#why-drawn", "06_why_learning_stops.html#why-drawn"),
    ],
)
def test_a_place_on_an_old_page_opens_the_place_on_the_new_one(old, new, site, browser):
    tab = browser.new_page()
    tab.goto(f"{(site / 'book').resolve().as_uri()}/{old}")
    tab.wait_for_url(f"**/{new}")
    assert tab.locator(f"[id='{new.partition('#')[2]}']").count() == 1
    tab.close()
