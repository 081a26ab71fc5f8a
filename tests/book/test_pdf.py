"""The book on paper: one PDF with an outline and tags, and pages that print whole."""

import json
import re
from pathlib import Path
from unicodedata import normalize

import pypdfium2
import pytest
import yaml
from bs4 import BeautifulSoup
from click.testing import CliRunner
from driver import project
from driver.paper import pdf, whole
from filelock import FileLock
from pypdf import PdfReader
from pypdf.generic import DictionaryObject, NameObject, TextStringObject


def test_without_a_built_book_the_reader_is_told_to_make_one(tmp_path):
    result = CliRunner().invoke(pdf.main, [str(tmp_path / "html")])
    assert result.exit_code == 1
    (sentence,) = result.output.strip().splitlines()
    assert "`make book`" in sentence


def test_without_a_chromium_the_reader_is_told_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "index.html").touch()
    (tmp_path / pdf.NAME).write_text("of an older book")
    monkeypatch.setenv("PATH", str(tmp_path))
    result = CliRunner().invoke(pdf.main, [str(tmp_path)])
    assert result.exit_code == 1
    (sentence,) = result.output.strip().splitlines()
    assert "apt-get install chromium" in sentence
    assert not (tmp_path / pdf.NAME).exists()


@pytest.mark.parametrize(
    ("words", "role"), [("Formula: x", "/Formula"), ("A plan", "/Figure"), ("", "/Div")]
)
def test_what_chromium_calls_a_figure_is_a_formula_a_picture_or_a_part(words, role):
    figure = DictionaryObject({NameObject("/S"): NameObject("/Figure")})
    figure[NameObject("/Alt")] = TextStringObject(words)
    pdf.retag(figure)
    assert figure["/S"] == role
    assert figure["/Alt"] == words.removeprefix("Formula: ")


@pytest.mark.parametrize(
    ("href", "target"),
    [
        ("two.html", "#book-two"),
        ("two.html#a-part", "#book-two--a-part"),
        ("#here", "#book-one--here"),
        ("api/room.html#f", "#book-api-room--f"),
        ("https://arxiv.org/abs/2502.04925", "https://arxiv.org/abs/2502.04925"),
        ("one.ipynb", ""),
        ("../genindex.html", ""),
    ],
)
def test_a_link_leads_within_the_document_if_its_page_is_there(href, target):
    names = ["book/one", "book/two", "book/api/room"]
    assert whole.address(href, "book/one", names) == target


@pytest.mark.parametrize(
    ("tex", "words"),
    [
        (r"\(V_{\boldsymbol{\theta}}(\mathbf{s})\)", "V_theta(s)"),
        (r"\(\alpha\beta \le \tfrac12\)", "alpha beta ≤ 1/2"),
        (r"\[ \mathbf{x}_{i+1} = f(\mathbf{u}_i) \]", "x_{i+1} = f(u_i)"),
        (r"\(\lVert\boldsymbol{\phi}\rVert^2\)", "‖phi‖^2"),
    ],
)
def test_a_formula_is_said_without_its_looks(tex, words):
    assert whole.spoken(tex) == words


PAGE = """<html><head>
<link rel="stylesheet" href="../_static/print.css?v=1">
<script>window.MathJax = {{}}</script><script src="../_static/mathjax.js?v=2"></script>
<script src="../_static/theme.js"></script></head><body>{banner}
<nav class="bd-links bd-docs-nav"><div>
<ul class="nav"><li>Chapter</li></ul>
</div>
</nav><article><section id="top">
<h1>{number}<span class="math">\\(Q\\)</span> is &lt; 1<a class="headerlink" href="#top">#</a></h1>
<p id="twice"><a href="other.html#twice">See</a> <a href="other.ipynb">the notebook</a></p>
<p id="twice"><img src="../_images/a.png" alt="A"></p>
<picture><source media="screen and (max-width: 720px)" srcset="../b-narrow.svg">
<source srcset="../b.svg"><img src="../b.png" alt="B"></picture>
<details><summary>Solution</summary>It is so.</details>
<section id="first"><h2>First</h2></section></section></article></body></html>"""
TOC = """root: book/one
parts:
  - {caption: Part, chapters: [{file: book/other}]}
  - {caption: The library, chapters: [{file: book/api}, {file: book/api_room}]}"""
CONFIG = "{title: A book, author: us}"


@pytest.fixture
def small(tmp_path, monkeypatch):
    """A site of two pages, with the settings it was made from."""
    (tmp_path / "_toc.yml").write_text(TOC)
    (tmp_path / "_config.yml").write_text(CONFIG)
    (tmp_path / "CITATION.cff").write_text((project.ROOT / "CITATION.cff").read_text())
    site = tmp_path / "_build/html"
    (site / "book").mkdir(parents=True)
    for name, number in (("one", ""), ("other", "1. ")):
        (site / f"book/{name}.html").write_text(PAGE.format(banner="", number=number))
    monkeypatch.setattr(project, "ROOT", tmp_path)
    return site


@pytest.fixture
def joined(small) -> BeautifulSoup:
    target = small.parent / "pdf/book.html"
    return BeautifulSoup(whole.document(small, target, "Version 0"), "html.parser")


def test_identifiers_of_the_document_are_unique_and_links_lead_to_them(joined):
    names = [element["id"] for element in joined.find_all(id=True)]
    assert len(names) == len(set(names))
    inner = [link["href"][1:] for link in joined.select("a[href^='#']")]
    assert "book-other--twice" in inner
    assert set(inner) <= set(names)


def test_what_is_only_for_the_screen_is_not_in_the_document(joined):
    assert not joined.select(".headerlink, a[href$='.ipynb']")
    assert joined.details.has_attr("open")
    assert [one["src"] for one in joined.select("script[src]")] == ["../html/_static/mathjax.js"]
    assert [one["src"] for one in joined.select("section#book-one img")] == [
        "../html/_images/a.png",
        "../html/b.svg",
    ]
    assert not joined.select("picture, source")


def test_headings_go_down_within_a_part_and_keep_their_words(joined):
    assert [(one.name, whole.plain(one)) for one in joined.find_all(re.compile("^h[1-6]$"))] == [
        ("h1", "Contents"),
        ("h1", "Q is < 1"),
        ("h2", "First"),
        ("h1", "Part"),
        ("h2", "1. Q is < 1"),
        ("h3", "First"),
    ]


def test_the_pages_of_the_api_are_not_printed(joined):
    assert [one["id"] for one in joined.select("body > section[id]")] == ["book-one", "book-other"]
    assert "The library" not in joined.text


def test_a_page_is_named_in_its_margin(joined):
    assert r'@page book-other { @top-right { content: "1. Q is \3c  1"; } }' in joined.style.text


def test_the_banner_of_a_build_that_is_not_the_book_is_on_the_title_page(small):
    banner = '<aside class="bd-header-announcement">A smoke build.</aside>'
    (small / "book/one.html").write_text(PAGE.format(banner=banner, number=""))
    text = whole.document(small, small / "book.html", "Version 0")
    cover = BeautifulSoup(text, "html.parser").select_one(".cover")
    assert "A smoke build." in cover.text


def test_every_page_offers_the_file_once(small):
    for size in (3e6, 4e6):
        pdf.offer(small, int(size))
    for name in ("one", "other"):
        nav = BeautifulSoup((small / f"book/{name}.html").read_text(), "html.parser").nav
        (link,) = nav.select("a")
        assert link["href"] == "../nmpcrl.pdf"
        assert link.text == "The book as a PDF (4 MB)"


PAGES = [name for name in project.pages() if not whole.API.fullmatch(name)]


@pytest.fixture(scope="module")
def book(printed) -> PdfReader:
    return PdfReader(printed)


@pytest.fixture(scope="module")
def texts(printed, shared) -> list[str]:
    """What can be read on each page, beyond its margins; read once for all workers."""
    kept = shared / "printed.json"
    with FileLock(kept.with_suffix(".lock")):
        if not kept.exists():
            kept.write_text(json.dumps(read(printed)))
        return json.loads(kept.read_text())


def read(printed: Path | bytes) -> list[str]:
    """What can be read on each page; pypdf takes as many minutes as this takes seconds."""
    with pypdfium2.PdfDocument(printed) as document:
        return [page.get_textpage().get_text_range() for page in document]


@pytest.fixture(scope="module")
def headings(site) -> list[str]:
    """Of all chapters and their sections, as the site has them."""
    found = []
    for name in PAGES:
        article = BeautifulSoup((site / f"{name}.html").read_text(), "html.parser").article
        for mark in article.select(".headerlink"):
            mark.decompose()
        found += [whole.plain(one) for one in article.find_all(["h1", "h2"])]
    return found


def flat(entries: list) -> list[str]:
    """The titles of an outline, of all levels."""
    nested = (flat(one) if isinstance(one, list) else [one.title] for one in entries)
    return [title for titles in nested for title in titles]


def test_the_outline_has_every_part_chapter_and_section_in_their_order(book, headings):
    titles = flat(book.outline)
    parts = yaml.safe_load((project.ROOT / "_toc.yml").read_text())["parts"]
    assert {part["caption"] for part in parts} <= set(titles)
    rest = iter(titles)
    assert [one for one in headings if one not in rest] == []


def test_the_file_is_tagged_and_says_what_it_is(book):
    root = book.root_object
    assert root["/MarkInfo"]["/Marked"]
    assert root["/StructTreeRoot"]["/K"]
    assert root["/Lang"] == "en"
    assert root["/ViewerPreferences"]["/DisplayDocTitle"]
    assert book.metadata.title
    assert book.metadata.creation_date


def test_pictures_and_formulas_are_tagged_with_words(book):
    objects = map(book.get_object, range(1, book.trailer["/Size"]))
    tags = [one for one in objects if isinstance(one, dict) and one.get("/Type") == "/StructElem"]
    for kind, example in (("/Formula", "theta"), ("/Figure", "obstacles")):
        words = [tag.get("/Alt", "") for tag in tags if tag["/S"] == kind]
        assert any(example in one for one in words)
        assert all(words), kind


LAST = """() => [...document.querySelectorAll(".bd-article")].flatMap(article => {
  const chain = [];  // what ends a chapter, from outside in
  for (let one = article; one; one = one.lastElementChild) chain.push(one);
  return chain.filter(one => parseFloat(getComputedStyle(one).marginBottom) > 0)
    .map(one => `${article.parentElement.id}: ${one.outerHTML.slice(0, 80)}`);
})"""


def test_no_chapter_ends_in_a_margin_that_could_begin_an_empty_page(site, browser):
    with browser.new_page() as tab:
        tab.emulate_media(media="print")
        tab.goto((site.parent / "pdf/book.html").as_uri())
        assert tab.evaluate(LAST) == []


def test_no_page_is_blank_and_their_number_is_sane(site, texts):
    assert all(len(text.split()) > 15 for text in texts)
    words = sum(
        len(BeautifulSoup((site / f"{name}.html").read_text(), "html.parser").article.text.split())
        for name in PAGES
    )
    assert words / 500 < len(texts) < words / 100


def test_what_is_folded_on_the_page_can_be_read(site, texts):
    page = BeautifulSoup((site / "book/04_ges.html").read_text(), "html.parser")
    solutions = page.select(".solution, details.hide")
    assert solutions
    text = "".join(normalize("NFKC", "".join(texts)).split())  # without ligatures
    for one in solutions:
        for code in one.select("pre"):  # whose text comes after that of the page
            assert "".join(code.get_text().split()) in text
        for other in one.select(".math, summary, pre"):
            other.replace_with("\0")
        longest = max(one.get_text().split("\0"), key=len)
        said = "".join(longest.split()).removeprefix("Solution")
        cuts = range(len(said) + 1)  # a page may end within it
        assert any(said[:cut] in text and said[cut:] in text for cut in cuts), said


def test_no_formula_is_left_as_it_is_typed(texts):
    for text in texts:
        assert not re.search(
            r"\\(boldsymbol|mathbf|theta|frac|begin|\(|\[)|\$[^\s\d(][^\n]*\$", text
        )


def test_links_between_pages_lead_within_the_file_and_none_to_the_disk(book):
    links = [
        note.get_object()
        for page in book.pages
        for note in page.get("/Annots", [])
        if note.get_object()["/Subtype"] == "/Link"
    ]
    inner = [link["/Dest"] for link in links if "/Dest" in link]
    assert set(inner) <= set(book.named_destinations)
    assert any("references--" in target for target in inner)
    outer = [link["/A"]["/URI"] for link in links if "/A" in link]
    assert outer
    assert all(re.match("https?://", address) for address in outer)


def test_the_table_of_contents_says_on_which_page_a_chapter_begins(book, texts):
    contents = normalize("NFKC", " ".join(" ".join(texts[1:10]).split()))  # without ligatures
    for entry in book.outline:
        for one in entry if isinstance(entry, list) else ():
            if not isinstance(one, list):
                page = book.get_destination_page_number(one) + 1
                assert f"{one.title} {page}" in contents


@pytest.mark.parametrize("page", ["book/04_ges", "book/05_results"])
def test_a_page_of_the_site_is_printed_open_light_and_without_the_sidebar(site, browser, page):
    tab = browser.new_page(color_scheme="dark")
    tab.goto((site / f"{page}.html").resolve().as_uri())
    tab.evaluate("window.MathJax?.startup?.promise")
    tab.evaluate(
        "addEventListener('beforeprint', () => seen = document.documentElement.dataset.theme)"
    )
    pages = read(tab.pdf())
    assert tab.evaluate("seen") == "light"
    assert tab.evaluate("document.documentElement.dataset.theme") == "dark"
    title = tab.title().split(" \u2014 ")[0]
    assert all(title in one for one in pages)  # in the margin
    assert "".join(pages[0].split()).count("".join(title.split())) == 2  # and above the text
    assert any("def " in one for one in pages)  # source that was folded
    assert not any("Search" in one or "Next" in one for one in pages)
    tab.close()
