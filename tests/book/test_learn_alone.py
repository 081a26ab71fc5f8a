"""The path of "Learn alone": a plain list that becomes one to check, with keys and from disk."""

import json
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from driver.teaching import self_test
from driver.teaching.declared import declared

STATIC = Path(__file__).resolve().parents[2] / "book/_static"
PAGE = """<!DOCTYPE html><html lang="en" data-theme="light"><head><title>Path</title>
<link rel="stylesheet" href="{static}/controls.css">
<link rel="stylesheet" href="{static}/exercises/exercises.css">
<link rel="stylesheet" href="{static}/syllabus.css">
{scripts}</head><body><main class="bd-article"><h1>Path</h1>
<section><h2>One</h2><div class="path"><ul><li><p><a href="a.html">Chapter 1</a>, 5 min</p></li>
<li><p>Live figure: <a href="a.html#live">Robot</a></p></li></ul></div></section>
<section><h2>Two</h2><div class="path"><ul><li><p>Rest</p></li></ul></div></section>
{more}</main></body></html>"""
SCRIPTS = ("exercises/words", "exercises/formula", "exercises/exercises", "path")
FULL = 'Storage.prototype.setItem = () => { throw new Error("full"); };'


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    scripts = "".join(f'<script src="{STATIC.as_uri()}/{name}.js"></script>' for name in SCRIPTS)
    asked = declared().self_test[:2]
    places = [self_test.question(k, one).split("\n\n")[2] for k, one in enumerate(asked, 1)]
    answer = '<details class="folded"><summary>Answer</summary></details>'
    more = "".join(f'<div class="exercise">How?</div>{place}{answer}' for place in places)
    path = tmp_path_factory.mktemp("path") / "page.html"
    path.write_text(PAGE.format(static=STATIC.as_uri(), scripts=scripts, more=more))
    return path.as_uri()


@pytest.fixture
def opened(browser, address):
    """Opens the page from disk for a reader with these settings."""
    contexts = []

    def with_settings(script: str = "", **settings):
        contexts.append(browser.new_context(viewport={"width": 390, "height": 900}, **settings))
        page = contexts[-1].new_page()
        page.add_init_script(script)
        page.goto(address)
        return page

    yield with_settings
    for context in contexts:
        context.close()


def checked(page) -> list[bool]:
    return [box.is_checked() for box in page.locator(".path input").all()]


def count(page) -> str:
    return page.locator(".path-progress [role=status]").inner_text()


def test_a_step_is_checked_with_keys_counted_and_remembered(opened):
    page = opened()
    assert count(page) == "0 of 3 steps are done. Kept in this browser only."
    page.get_by_role("checkbox", name="Live figure: Robot").focus()
    page.keyboard.press("Space")
    assert count(page).startswith("1 of 3")
    page.reload()
    assert checked(page) == [False, True, False]
    page.keyboard.press("Tab")  # Clear all marks stands before the first step
    page.keyboard.press("Enter")
    assert checked(page) == [False] * 3
    page.reload()
    assert checked(page) == [False] * 3


def test_a_click_on_a_box_checks_it_and_one_on_a_link_does_not(opened):
    page = opened()
    page.locator(".path input").last.click()
    assert checked(page) == [False, False, True]
    page.locator(".path a").first.evaluate("link => (link.onclick = () => false)")
    page.locator(".path a").first.click()
    assert checked(page) == [False, False, True]


def test_without_scripts_it_is_a_plain_list_whose_words_and_links_remain(opened):
    page = opened(java_script_enabled=False)
    assert page.locator("input, button").count() == 0
    assert page.locator(".path li").all_inner_texts()[0] == "Chapter 1, 5 min"
    assert page.locator(".path a").count() == 2


@pytest.mark.parametrize("stored", ["{", '{"a.html": 1}', "null", "[1, null]"])
def test_what_another_page_stored_under_this_name_does_no_harm(opened, stored):
    page = opened(f"localStorage.setItem('nmpcrl.path', {json.dumps(stored)})")
    assert checked(page) == [False] * 3


def test_a_browser_that_keeps_nothing_says_so(opened):
    page = opened(FULL)
    page.locator(".path input").first.check()
    assert count(page).startswith("1 of 3 steps are done. This browser keeps nothing")


def test_a_page_with_a_path_and_questions_is_accessible(opened):
    page = opened()
    found = Axe().run(page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag22aa"]})
    assert found.response["violations"] == []


def test_a_wrong_answer_of_the_self_test_says_why_and_opens_no_answer(opened):
    page = opened()
    second = page.locator('[data-exercise="self-test-2"]')
    second.get_by_role("radio", name="a", exact=True).focus()
    page.keyboard.press("Space")
    page.keyboard.press("Enter")
    assert second.locator(".said").inner_text() == "Each step multiplies by more than one."
    assert page.locator("details[open]").count() == 0
    second.get_by_role("radio", name="c", exact=True).check()
    page.keyboard.press("Enter")
    assert second.get_attribute("data-verdict") == "right"
    assert "1 of 2" in page.locator(".exercise-progress").inner_text()
