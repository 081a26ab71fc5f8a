"""Live figures as a reader finds them."""

from collections.abc import Callable, Iterator

import pytest
from live_page import Tab


@pytest.fixture
def opened(site, browser) -> Iterator[Callable[..., Tab]]:
    """Opens the page of a live figure as a reader with these settings would."""
    contexts = []

    def with_settings(figure, script="", chapter=None, **settings):
        contexts.append(browser.new_context(**settings))
        page = contexts[-1].new_page()
        if script:
            page.add_init_script(script)
        return Tab(page, site, figure, chapter)

    yield with_settings
    for context in contexts:
        context.close()


@pytest.fixture
def tab(opened, request) -> Iterator[Tab]:
    """The page of a module's FIGURE on a large screen; it has no errors and asks nobody."""
    tab = opened(request.module.FIGURE, viewport={"width": 1400, "height": 1000}).begun()
    yield tab
    assert tab.errors == []
    assert tab.external() == []
