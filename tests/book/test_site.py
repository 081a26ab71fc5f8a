"""The built book: whole, without a dead link or an external request, readable on a phone."""

import functools
import http.server
import re
import threading
from urllib.parse import unquote, urldefrag, urlsplit

import build
import pytest
from bs4 import BeautifulSoup, Tag
from legibility import LETTERS, SHOWN

from nmpcrl.claims import published
from nmpcrl.claims.rule import Verdict
from nmpcrl.report.tables import BADGES, WORDS

pytestmark = pytest.mark.book

PAGES = build.pages()
LOADED = {  # what a browser fetches by itself
    "script": "src",
    "img": "src",
    "iframe": "src",
    "source": "src",
    "link": "href",
}

each_page = pytest.mark.parametrize("page", PAGES)


@pytest.fixture(scope="session")
def html(site):
    """A parsed page of the site, by path."""
    return functools.cache(lambda path: BeautifulSoup((site / path).read_text(), "html.parser"))


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
        if not address or urlsplit(address).scheme:
            continue
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


LETTERS_OF_SVG = re.compile(  # matplotlib draws letters 100 high and scales them
    r'<g (?:style="[^"]*" )?transform="translate\([^)]*\)(?: rotate\([^)]*\))? scale\(([\d.]+) '
)


def letters(svg: str) -> float:
    """Height of the smallest letters of a picture, over its width."""
    width = float(re.search(r'<svg [^>]*width="([\d.]+)pt"', svg)[1])
    return min(100 * float(scale) for scale in LETTERS_OF_SVG.findall(svg)) / width


@each_page
def test_every_figure_is_whole_and_readable_on_every_screen(site, html, page):
    """A narrow file for telephones, a PNG beside each SVG, and letters of at least 10 pixels."""
    folder = (site / f"{page}.html").parent
    for image in html(f"{page}.html").find("article").find_all("img"):
        picture = image.find_parent("picture")
        assert picture, f"{image['src']} has no narrow version"
        narrow, wide = (folder / one["srcset"] for one in picture.find_all("source"))
        assert int(picture.find("source")["width"]) <= 360
        if wide != folder / "../_static/closed_loop.svg":  # is stored, an SVG alone
            assert (folder / image["src"]).suffix == ".png"
        for file, is_narrow in ((wide, False), (narrow, True)):
            if file.suffix == ".svg":
                assert letters(file.read_text()) * SHOWN[is_narrow] >= LETTERS, file.name


def test_small_letters_are_found():
    small = (
        '<svg width="504pt"><g transform="translate(1 2) rotate(-90) scale(0.06 -0.06)">'
        '<g style="fill: #000000" transform="translate(1 2) scale(0.1 -0.1)">'
    )
    assert letters(small) == 6 / 504


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


def test_the_entry_opens_the_introduction(site, browser):
    tab = browser.new_page()
    tab.goto((site / "index.html").resolve().as_uri())
    tab.wait_for_url(f"**/{PAGES[0]}.html")
    tab.close()


CLAIM = r"[BC]\d"
LISTED = rf"\(({CLAIM}(?:(?:, | and ){CLAIM})*)\)"
COUNTED = re.compile(rf"(?:\w+ (?:is|are)|for \w+) ([a-z][a-z ]*[a-z]) {LISTED}")
SHARE = re.compile(r"(\d+)% \[(\d+)%, (\d+)%\]|(\d\.\d\d) \[(\d\.\d\d), (\d\.\d\d)\]")
COUNT = re.compile(r"\d+ of (\d+) (?:runs|pairs)")
TIME = re.compile(
    r"(RDES|GES) t(?:akes|ook) (\d\.\d\d)(?: \[[\d., ]+\])? of (?:the time of )?(?:a step of )?ES"
    r" (?:with (Ipopt|fatrop|riccati)|\(C[34])"
)
SOLVER = {"Ipopt": "ipopt", None: "ipopt"}


def contradictions(page: BeautifulSoup, known: dict[str, Verdict]) -> list[str]:
    """Where a page names a claim with an outcome, a share, a ratio or a count that is another."""
    article = page.find("article")
    wrong = [one for badge in article.select(BADGE) for one in badly_labelled(badge, known)]
    for block in article.find_all(["p", "li", "td"]):
        if block.find(["p", "li", "td"]):
            continue  # its parts are looked at
        text = " ".join(block.get_text(" ").split())
        for words, names in COUNTED.findall(text):
            wrong += [f"{c} {words}" for c in re.findall(CLAIM, names) if known[c].words != words]
        wrong += badly_counted(text, known)
    return wrong


BADGE = ", ".join(f".{style}" for style in BADGES.values())


def badly_labelled(badge: Tag, known: dict[str, Verdict]) -> list[str]:
    """What is wrong with a coloured outcome and the number below it, in a table or a list."""
    row = badge.find_parent(["tr", "li"])
    name = row and row.find("strong") and re.match(CLAIM, row.find("strong").get_text())
    if not name:
        return []  # of an assumption, or of a target
    verdict, cell = known[name[0]], badge.find_parent(["td", "li"])
    expected, column = verdict.outcome, heading(cell)
    if column in verdict.by_layout | verdict.by_decay:
        expected = (verdict.by_layout | verdict.by_decay)[column]
    elif verdict.words == badge.get_text():
        expected = None
    wrong = [] if expected is None or badge.get_text() == WORDS[expected] else [badge.get_text()]
    if cell.name == "td" and (found := SHARE.search(" ".join(cell.get_text(" ").split()))):
        value = verdict.ratio if verdict.share is None else verdict.share
        form = ".2f" if verdict.share is None else ".0%"
        low, high = (format(one, form) for one in verdict.interval)
        wrong += [] if found[0] == f"{value:{form}} [{low}, {high}]" else [found[0]]
    return [f"{name[0]} {one}" for one in wrong]


def heading(cell: Tag) -> str:
    """What stands above a cell, without "per": the layout, or the reading of the decay."""
    heads = cell.find_parent("table").select("thead th") if cell.name == "td" else []
    index = len(cell.find_previous_siblings(["th", "td"])) if heads else 0
    return heads[index].get_text().strip().removeprefix("per ") if heads else ""


def badly_counted(text: str, known: dict[str, Verdict]) -> list[str]:
    """Counts of all runs of the one claim that a paragraph names, if its verdict has others."""
    names = {name for name in re.findall(rf"\b{CLAIM}\b", text) if name in known}
    if len(names) != 1:
        return []
    verdict = known[names.pop()]
    said = " ".join((verdict.evidence, verdict.halves, *verdict.as_claimed, *verdict.reverse))
    every = {str(of) for _, of in verdict.counts.values()}
    counts = [found[0] for found in COUNT.finditer(text) if found[1] in every]
    return [f"{verdict.claim} {count}" for count in counts if count not in said]


@pytest.fixture(scope="session")
def known() -> dict[str, Verdict]:
    """The published verdicts, by claim."""
    return {verdict.claim: verdict for verdict in published.load().verdicts}


@each_page
def test_a_page_names_no_claim_with_another_outcome_or_count_than_the_published_one(
    html, known, page
):
    assert contradictions(html(f"{page}.html"), known) == []


@pytest.mark.parametrize("page", ["intro", "05_results", "reproducibility"])
def test_the_pages_that_list_the_papers_claims_show_every_verdict(html, known, page):
    shown = html(f"book/{page}.html").select(f"td :is({BADGE})")
    names = [badge.find_parent("tr").find("strong") for badge in shown]
    assert {name.get_text() for name in names if name} >= {c for c in known if c.startswith("C")}


def test_every_ratio_of_times_is_the_published_one(html):
    found = published.load()
    for page in PAGES:
        text = " ".join(html(f"{page}.html").find("article").get_text(" ").split())
        for learner, ratio, solver in TIME.findall(text):
            expected = found.ratio(SOLVER.get(solver or None, solver), learner).value
            assert ratio == f"{expected:.2f}", f"{page}: {learner} {ratio} with {solver}"
    assert TIME.search(" ".join(html("book/05_results.html").find("article").get_text(" ").split()))


@pytest.mark.parametrize(
    "wrong",
    [
        '<tr><td><strong>C2</strong> So.</td><td><span class="verdict-partly">partly reproduced'
        "</span></td></tr>",
        '<tr><td><strong>C1</strong> So.</td><td><span class="verdict-partly">partly reproduced'
        "</span><br>23% [15%, 30%]</td></tr>",
        "<tr><td>One is partly reproduced (C2).</td></tr>",
        "<tr><td>Of C1, it holds in 27 of 120 pairs.</td></tr>",
    ],
    ids=["outcome", "share", "sentence", "count"],
)
def test_a_contradiction_is_found(known, wrong):
    page = BeautifulSoup(f"<article><table>{wrong}</table></article>", "html.parser")
    assert len(contradictions(page, known)) == 1


def test_a_layouts_outcome_is_held_against_that_layouts(known):
    cells = {"A": "partly", "B": "no"}
    for shown, count in ((cells, 0), (cells | {"B": "yes"}, 1)):
        head = "".join(f"<th>{name}</th>" for name in ("Claim", *shown))
        row = "".join(
            f'<td><span class="verdict-partly">{one}</span></td>' for one in shown.values()
        )
        table = f"<thead><tr>{head}</tr></thead><tr><th><strong>C1</strong></th>{row}</tr>"
        page = BeautifulSoup(f"<article><table>{table}</table></article>", "html.parser")
        assert len(contradictions(page, known)) == count
