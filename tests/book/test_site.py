"""The built book: whole, without a dead link or an external request, readable on a phone."""

import functools
import http.server
import re
import threading
from dataclasses import dataclass, field
from urllib.parse import unquote, urldefrag, urlsplit

import build
import pytest
from bs4 import BeautifulSoup

pytestmark = pytest.mark.book

PAGES = build.pages()
LOADED = {  # what a browser fetches by itself
    "script": "src",
    "img": "src",
    "iframe": "src",
    "source": "src",
    "link": "href",
}

UNREADABLE = "[data-mjx-error], mjx-container mtext[mathcolor=red]"  # errors, unknown macros

each_page = pytest.mark.parametrize("page", PAGES)


@pytest.fixture(scope="session")
def html(site):
    """A parsed page of the site, by path."""
    return functools.cache(lambda path: BeautifulSoup((site / path).read_text(), "html.parser"))


@each_page
def test_every_entry_of_the_table_of_contents_is_a_page_with_a_heading(html, page):
    assert html(f"{page}.html").find("h1")


@each_page
def test_no_image_link_or_anchor_leads_nowhere(site, html, page):
    here = site / f"{page}.html"
    for element in html(f"{page}.html").find_all(["a", *LOADED]):
        address = element.get(LOADED.get(element.name, "href"), "")
        path, anchor = urldefrag(address)
        if not address or urlsplit(address).scheme:
            continue
        target = (here.parent / unquote(urlsplit(path).path)).resolve() if path else here
        assert target.exists(), address
        if anchor and target.suffix == ".html":
            ids = html(str(target.relative_to(site.resolve())))
            assert ids.find(id=unquote(anchor)) or ids.find(attrs={"name": anchor}), address


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
def test_nothing_on_a_page_or_in_its_styles_names_another_host(site, html, page):
    for element in html(f"{page}.html").find_all(list(LOADED)):
        assert not urlsplit(element.get(LOADED[element.name], "")).netloc
    for sheet in site.rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*['\"]?(https?:)?//", sheet.read_text()), sheet


@dataclass
class Visit:
    """What a browser saw of a page."""

    requests: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    formulas: int = 0  # that the page holds
    typeset: int = 0  # of them, by MathJax
    broken: list[str] = field(default_factory=list)  # those that MathJax could not read
    width: int = 0  # of the page on a telephone [px]


@pytest.fixture(scope="session")
def visit(site, browser):
    """Open a page from disk, once a session, and note what happens."""

    @functools.cache
    def open_page(page: str) -> Visit:
        seen = Visit()
        tab = browser.new_page(viewport={"width": 390, "height": 844})
        tab.on("request", lambda request: seen.requests.append(request.url))
        tab.on("pageerror", lambda error: seen.errors.append(str(error)))
        tab.on("requestfailed", lambda request: seen.errors.append(f"failed: {request.url}"))
        tab.on(
            "console", lambda said: seen.errors.append(said.text) if said.type == "error" else None
        )
        tab.goto((site / f"{page}.html").resolve().as_uri())
        tab.evaluate("window.MathJax?.startup?.promise")
        seen.formulas = tab.locator("article .math").count()
        seen.typeset = tab.locator("article .math:has(mjx-container)").count()
        seen.broken = tab.locator(UNREADABLE).evaluate_all("all => all.map(one => one.outerHTML)")
        seen.width = tab.evaluate("document.documentElement.scrollWidth")
        tab.close()
        return seen

    return open_page


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


def test_the_entry_opens_the_introduction(site, browser):
    tab = browser.new_page()
    tab.goto((site / "index.html").resolve().as_uri())
    tab.wait_for_url(f"**/{PAGES[0]}.html")
    tab.close()
