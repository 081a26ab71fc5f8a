"""The decks of the built book: they work from disk, with the keyboard."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path

import pytest
from driver.course import slides
from pypdf import PdfReader

ROOT = Path(__file__).resolve().parents[2]
UNITS = {name: text for name, text, _ in slides.units()}
LIVE = [name for name, text in UNITS.items() if "-live)" in text]

each_unit = pytest.mark.parametrize("name", UNITS)
pytestmark = pytest.mark.weekly  # as all of the course

SMALL = """(() => {
    const words = document.createTreeWalker(Reveal.getCurrentSlide(), NodeFilter.SHOW_TEXT);
    const found = [];
    while (words.nextNode()) {
        const at = words.currentNode.parentElement, text = at.closest("text");
        if (!words.currentNode.data.trim() || !at.getClientRects().length) continue;
        if (at.closest("aside.notes, mjx-assistive-mml, option, title")) continue;
        const scale = text ? text.getScreenCTM().a : 1;
        const size = scale * parseFloat(getComputedStyle(at).fontSize);
        if (size < 19.9) found.push([size, words.currentNode.data]);
    }
    return found;
})()"""
LETTERS = """[...Reveal.getCurrentSlide().querySelectorAll("img")].map((image) => [
    image.getAttribute("src"),
    Math.min(image.width / image.naturalWidth, image.height / image.naturalHeight)
        * image.naturalWidth / 504 * 8])"""  # a figure is 504 pt wide, and its small letters 8 pt

FITS = "b => b.scrollHeight <= b.clientHeight && b.scrollWidth <= b.clientWidth"
SIZE = "[Reveal.getCurrentSlide()].flatMap(s => [s.scrollWidth, s.scrollHeight])"


class Images(HTMLParser):
    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[dict] = []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        if tag == "img":
            self.found.append(dict(attrs))


@pytest.fixture(scope="session")
def decks(site, tmp_path_factory) -> Path:
    """The decks of the built book."""
    if find_spec("sphinx_revealjs") is None:
        pytest.skip("sphinx-revealjs is not installed")
    place = tmp_path_factory.mktemp("decks")
    slides.make(ROOT / slides.EXECUTED, place / "one")
    return place / "one"


@pytest.fixture
def shown(decks, browser):
    """Opens a deck in a browser; nothing outside the folder is asked for, and nothing fails."""
    tab = browser.new_page(viewport={"width": 1280, "height": 720})
    wrong: list[str] = []
    tab.on("pageerror", lambda error: wrong.append(str(error)))
    tab.on("requestfailed", lambda request: wrong.append(request.url))
    inside = ("data:", "blob:", "about:", decks.resolve().as_uri())
    tab.on("request", lambda r: r.url.startswith(inside) or wrong.append(r.url))

    def opened(name: str, query: str = ""):
        tab.goto(f"{(decks / name).resolve().as_uri()}.html{query}")
        tab.wait_for_selector("html[data-ready]", state="attached")
        return tab

    yield opened
    tab.close()
    assert wrong == []


@each_unit
def test_a_deck_has_a_title_and_ten_to_fifteen_slides_and_says_what_pictures_show(decks, name):
    page = (decks / f"{name}.html").read_text()
    assert page.count("<h1>") == 1
    assert 10 <= page.count("<section") <= 15
    names = re.findall(r'<section id="([^"]+)"', page)
    assert len(names) == len(set(names))
    images = Images(page).found
    assert all(image["alt"] and (decks / image["src"]).exists() for image in images)
    assert "<h2></h2>" not in page


def test_two_decks_are_the_same_bytes(decks):
    again = decks.parent / "two"
    slides.make(ROOT / slides.EXECUTED, again)
    files = [path for path in decks.rglob("*") if path.is_file() and path.suffix != ".pdf"]
    assert len(files) > 2 * len(UNITS)
    for path in files:
        assert path.read_bytes() == (again / path.relative_to(decks)).read_bytes(), path


@each_unit
def test_arrows_move_and_every_slide_fits_and_has_no_formula_in_error(shown, name):
    tab = shown(name)
    last = tab.evaluate("Reveal.getTotalSlides()") - 1
    for step in range(last + 1):
        assert tab.evaluate("Reveal.getIndices().h") == step
        slide = tab.evaluate(SIZE)
        assert max(slide[0] - 1280, slide[1] - 720) <= 0, (step, slide)
        assert tab.evaluate(SMALL) == [], step
        assert [figure for figure, size in tab.evaluate(LETTERS) if size < 19.9] == []
        tab.keyboard.press("ArrowRight")
    tab.keyboard.press("ArrowLeft")
    assert tab.evaluate("Reveal.getIndices().h") == last - 1
    assert tab.locator("mjx-container").count() > 0
    assert tab.locator("[data-mjx-error], mjx-merror").count() == 0


def test_the_notes_are_shown_by_a_key(shown):
    tab = shown(LIVE[0])
    assert not tab.locator(".speaker-notes").is_visible()
    tab.keyboard.press("n")
    assert "left for questions" in tab.locator(".speaker-notes").inner_text()


def test_the_window_of_the_speaker_has_each_formula_once(shown):
    tab = shown("13_the_solver")
    tab.evaluate("Reveal.slide(Reveal.getSlides().findIndex(s => s.id.startsWith('a-constraint')))")
    with tab.expect_popup() as opened:
        tab.keyboard.press("s")
    notes = opened.value.locator(".speaker-controls-notes .value")
    notes.locator("mjx-container").first.wait_for()
    assert notes.locator("mjx-container svg").first.bounding_box()["width"] > 5
    for hidden in notes.locator("mjx-assistive-mml").all():
        assert max(hidden.bounding_box()[side] for side in ("width", "height")) <= 1


@pytest.mark.parametrize("name", LIVE)
def test_a_live_figure_fits_its_slide_works_there_and_keeps_the_arrow_keys(shown, name):
    tab = shown(name)
    slides = "Reveal.getSlides().map((s, k) => s.querySelector('.live') ? k : -1)"
    for where in [k for k in tab.evaluate(slides) if k >= 0]:
        tab.evaluate(f"Reveal.slide({where})")
        box = tab.locator("section.present .live-figure")
        figure = box.locator("figure.live")
        slider = figure.locator("input[type=range]").first
        slider.wait_for()
        assert box.evaluate(FITS)
        before = slider.input_value()
        slider.focus()
        tab.keyboard.press("ArrowLeft" if before == slider.get_attribute("max") else "ArrowRight")
        assert slider.input_value() != before
        assert tab.evaluate("Reveal.getIndices().h") == where


PRINTED = """import sys, pathlib
from driver.course import slides
slides.printed([pathlib.Path(sys.argv[1])])"""


def test_a_pdf_has_a_wide_page_for_each_slide_but_the_live_ones(decks):
    path = decks / f"{LIVE[0]}.html"
    run = [sys.executable, "-c", PRINTED, str(path)]  # another Chromium needs another process
    subprocess.run(run, check=True, cwd=ROOT / "book")
    page = path.read_text()
    pages = PdfReader(path.with_suffix(".pdf")).pages
    assert len(pages) == page.count("<section") - page.count('class="live-figure"')
    assert float(pages[0].mediabox.width / pages[0].mediabox.height) == pytest.approx(16 / 9, 0.01)
