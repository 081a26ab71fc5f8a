"""The article: what it says comes from what is published, and no number is typed in it."""

import re
from io import BytesIO

import pytest
import typst
from bs4 import BeautifulSoup
from click.testing import CliRunner
from driver.paper import article, markup
from driver.project import from_yaml
from pypdf import PdfReader

from nmpcrl.claims import published
from nmpcrl.claims.paper_claims import CLAIMS
from nmpcrl.claims.prespecified import fixed
from nmpcrl.study.departures import DEPARTURES

NO_TEXT = re.compile(r"\$.*?\$|[\d.]+(?:fr|%)|@\w+|\.at\(\d\)|slice\(\d\)", flags=re.S)
NUMBER = re.compile(r"\d|\b(three|four|five|six|seven|eight|nine|ten|twelve|hundred|percent)\b")


@pytest.fixture(scope="module")
def given() -> article.Source:
    return article.source()


@pytest.fixture(scope="module")
def pages(given, tmp_path_factory) -> list[str]:
    """The text of the article, page by page, each as one line."""
    place = tmp_path_factory.mktemp("article")
    pdf = article.typeset(article.values(given), article.figures(given), place / "typst")
    return [" ".join(page.extract_text().split()) for page in PdfReader(BytesIO(pdf)).pages]


def test_no_number_is_typed_in_the_template():
    _, _, words = article.TEMPLATE.read_text("utf-8").partition("no number is typed below this")
    assert "= Results" in words
    assert NUMBER.findall(NO_TEXT.sub("", words)) == []


def test_it_needs_no_package_and_no_font_of_the_system():
    text = article.TEMPLATE.read_text("utf-8")
    known = set(typst.Fonts(include_system_fonts=False).families())
    assert "@preview" not in text
    assert set(re.findall(r'font: "([^"]+)"', text)) <= known


@pytest.mark.slow
def test_it_has_the_published_verdicts_and_the_numbers_on_which_they_rest(pages):
    text = "".join(pages).replace("\u00ad", "")
    verdicts = [one for one in published.load().verdicts if one.claim in CLAIMS]
    assert len(verdicts) == len(CLAIMS)
    for one in verdicts:
        assert f"{one.claim}, {one.words}. " in text
        if one.counts:
            assert "held in {} of {}".format(*one.counts["all"]) in text
        if one.ratio is not None:
            assert f"a step takes {one.ratio:.2f} of the time" in text


@pytest.mark.slow
def test_it_has_what_the_finding_counts_and_the_commit_that_fixed_the_thresholds(given, pages):
    text = "".join(pages)
    assert given.seen
    for yes, of in (given.seen.arrived_open, given.seen.arrived_closed, given.seen.stopped):
        assert f"{yes} of {of} runs of" in text
    assert fixed(given.found.about)["thresholds"]["hash"][:10] in text


@pytest.mark.slow
def test_it_has_six_to_eight_pages_and_each_of_them_is_full_or_the_last(pages):
    assert 6 <= len(pages) <= 8
    assert all(len(page.split()) > 200 for page in pages[:-1])


def test_every_departure_can_be_typeset_with_words_for_its_formulas():
    texts = [text for one in DEPARTURES.values() for text in (one.gap, one.reading, one.why)]
    document = '#set document(title: "All")\n' + "\n\n".join(map(markup.text, texts))
    assert typst.compile(document.encode(), format="pdf", pdf_standards=["ua-1"])


def test_words_that_look_like_markup_are_shown_as_they_are():
    shown = markup.text("*A* run of `x_1` # 2 costs <data>$5</data>, see [Fig. 1.2](one.md#a_b).")
    assert shown == r'#emph[A] run of #raw("x_1") \# 2 costs \$5, see Fig. 1.2 of the book.'


def test_what_cannot_be_converted_is_refused():
    with pytest.raises(KeyError, match="unheard"):
        markup.text(r"$\unheard{x}$")


def test_a_table_keeps_its_header_its_lines_and_what_is_bold():
    table = "<table><tr><th>A</th></tr><tr><td><strong>C1</strong> b_c<br>d</td></tr></table>"
    assert markup.rows(table) == [["A"], [r"#strong[C1] b\_c \ d"]]


def test_a_page_with_a_place_offers_the_article_once(tmp_path):
    path = tmp_path / "book/intro.html"
    path.parent.mkdir()
    path.write_text('<div class="the-article"></div>')
    for pages in (7, 8):
        article.offer(tmp_path, pages, 400_000)
    (link,) = BeautifulSoup(path.read_text(), "html.parser").find_all("a")
    assert link["href"] == "../nmpcrl-article.pdf"
    assert "on 8 pages (PDF, 0.4 MB)" in " ".join(link.parent.text.split())


def test_without_a_built_book_the_reader_is_told_to_make_one(tmp_path):
    result = CliRunner().invoke(article.main, [str(tmp_path / "html")])
    assert result.exit_code == 1
    (sentence,) = result.output.strip().splitlines()
    assert "`make book`" in sentence


def test_the_built_book_offers_it_on_its_first_page(site, html):
    link = html("book/intro.html").select_one(".the-article a")
    assert link
    assert (site / "book" / link["href"]).resolve() == (site / article.NAME).resolve()
    assert PdfReader(site / article.NAME).metadata.title == from_yaml("metadata.yaml")["title"]
