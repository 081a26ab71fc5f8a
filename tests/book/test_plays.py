"""A figure that plays: with a click, with the keyboard, and without a script at its own address."""

import pytest

PAGE, LINK = "book/changing_world.html", 'a[href$=".svg#play"]'
PAUSE = 700  # milliseconds between two looks


@pytest.fixture
def page(site, browser):
    opened = browser.new_page(viewport={"width": 1200, "height": 900})
    opened.goto((site / PAGE).as_uri())
    yield opened
    opened.close()


def moves(page, what) -> bool:
    """Whether a part of a page changes by itself."""
    before = what.screenshot(animations="allow")
    page.wait_for_timeout(PAUSE)
    return what.screenshot(animations="allow") != before


@pytest.mark.weekly
@pytest.mark.parametrize("key", [None, "Enter", "Space"])
def test_a_figure_stands_until_it_is_asked_to_play_and_again_afterwards(page, key):
    image, button = page.locator(f"{LINK} img").first, page.get_by_role("button", name="Play")
    image.scroll_into_view_if_needed()

    def turn():
        if key is None:
            image.click()
        else:
            page.locator("button.plays").first.press(key)

    assert not moves(page, image)
    assert button.count() >= 1
    for plays, name in ((True, "Stop"), (False, "Play")):
        turn()
        page.wait_for_function("([i, on]) => i.currentSrc.endsWith('#play') === on",
                               arg=[image.element_handle(), plays])  # fmt: skip
        assert moves(page, image) is plays
        assert page.locator("button.plays").first.inner_text().endswith(name)
        assert page.url.endswith(PAGE)


def test_without_a_script_the_link_leads_to_the_figure_that_plays(site, browser):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((site / PAGE).as_uri())
    assert page.locator("button.plays").count() == 0
    page.locator(LINK).first.click()
    page.wait_for_url("**/*.svg#play")
    assert moves(page, page)
    context.close()
