"""What holds of every live figure: its picture, its weight, and who can use it."""

from itertools import pairwise

import pytest
from live_page import ALSO, CHAPTERS, MOST, loaded

PICTURE = "article img"
FIRST = {chapter: figure for figure, chapter in reversed(CHAPTERS.items())}  # of each chapter
IN_ORDER = f"""() => [...document.querySelectorAll("{PICTURE}, figure.live")]
    .map(one => one.matches("img") ? "picture" : one.dataset.figure)"""
each_chapter = pytest.mark.parametrize("figure", FIRST.values(), ids=FIRST)
each_figure = pytest.mark.parametrize("figure", CHAPTERS)


def test_only_a_page_with_a_live_figure_loads_scripts_for_it(site):
    pages = {path.stem for path in site.glob("book/*.html") if "_static/live/" in path.read_text()}
    assert pages == {*CHAPTERS.values(), *ALSO}


@each_chapter
def test_what_a_chapters_live_figures_load_is_light(site, figure):
    assert loaded(site, figure) <= MOST


@each_chapter
def test_without_javascript_there_are_the_pictures_alone(opened, figure):
    tab = opened(figure, java_script_enabled=False)
    assert_pictures_alone(tab.page)
    opening, *order = tab.page.evaluate(IN_ORDER)  # which is above all pictures
    for before, name in pairwise([opening, *order]):
        assert "picture" in (before, name), f"{name} stands on no picture"


@pytest.mark.weekly
@each_chapter
def test_without_webassembly_there_are_the_pictures_and_a_sentence(opened, figure):
    tab = opened(figure, script="delete window.WebAssembly")
    tab.page.wait_for_selector("figure.live p")
    for live in tab.page.locator("figure.live").all():
        assert "does not run WebAssembly" in live.inner_text()
        assert live.locator("svg").count() == 0
    assert tab.page.locator(PICTURE).first.is_visible()
    assert tab.errors == []


@pytest.mark.weekly
@each_chapter
def test_on_paper_there_are_the_pictures_alone(opened, figure):
    tab = opened(figure).begun()
    tab.page.emulate_media(media="print")
    assert_pictures_alone(tab.page)


def assert_pictures_alone(page):
    pictures, figures = page.locator(PICTURE).all(), page.locator("figure.live").all()
    assert pictures
    assert all(one.is_visible() for one in pictures)
    assert figures
    assert not any(one.is_visible() for one in figures)


@each_chapter
def test_axe_looks_at_live_figures_that_have_begun(visit, figure):
    chapter = CHAPTERS[figure]
    shown = [name for name, where in CHAPTERS.items() if where == chapter]
    assert sorted(visit(f"book/{chapter}").figures) == sorted(shown)


@each_figure
def test_a_finger_can_hit_everything_on_a_telephone(opened, figure):
    tab = opened(figure, viewport={"width": 390, "height": 844}).begun()
    tab.shown()
    aimed_at = ".reach, input:not([type=radio]), label:has([type=radio]), button, select"
    for target in tab.figure.locator(f":is({aimed_at}):visible").all():
        box = target.bounding_box()
        assert min(box["width"], box["height"]) >= 24


@pytest.mark.parametrize(
    "motion", ["no-preference", pytest.param("reduce", marks=pytest.mark.weekly)]
)
@each_figure
def test_nothing_moves_by_itself(opened, figure, motion):
    tab = opened(figure, reduced_motion=motion).begun().quiet()
    tab.figure.evaluate(
        """figure => {
          window.changes = 0
          const options = {subtree: true, childList: true, attributes: true}
          new MutationObserver(all => window.changes += all.length).observe(figure, options)
        }"""
    )
    tab.later()
    assert tab.page.evaluate("window.changes") == 0
