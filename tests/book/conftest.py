"""Pages of the built book, and live figures as a reader finds them."""

import functools
import json
from collections.abc import Callable, Iterator
from dataclasses import asdict

import pytest
from bs4 import BeautifulSoup
from filelock import FileLock
from live_page import Tab
from visits import EACH_PUSH, PATIENCE, Visit, look_at


@pytest.fixture(scope="session")
def html(site) -> Callable[[str], BeautifulSoup]:
    """A parsed page of the site, by path."""
    return functools.cache(lambda path: BeautifulSoup((site / path).read_text(), "html.parser"))


@pytest.fixture(scope="session")
def visit(site, browser, shared) -> Callable[[str], Visit]:
    """Open a page of the site, once for all tests and workers, and look at it."""

    @functools.cache
    def seen(page: str) -> Visit:
        kept = shared / f"{page.replace('/', '-')}.json"
        with FileLock(kept.with_suffix(".lock")):
            if not kept.exists():
                found = look_at(browser, site / f"{page}.html", EACH_PUSH)
                kept.write_text(json.dumps(asdict(found)))
            return Visit(**json.loads(kept.read_text()))

    return seen


MATHJAX = "**/tex-svg-full.js*"
AS_TYPED = """document.head.insertAdjacentHTML(
    "beforeend", "<style>.math { overflow: hidden }</style>")"""


@pytest.fixture
def opened(site, browser) -> Iterator[Callable[..., Tab]]:
    """Opens the page of a live figure as a reader with these settings would.

    Its formulas are not typeset unless that is asked for: it takes as long as most tests.
    """
    contexts = []

    def with_settings(figure, script="", *, chapter=None, formulas=False, **settings):
        contexts.append(browser.new_context(**settings))
        contexts[-1].set_default_timeout(PATIENCE)
        if not formulas:
            contexts[-1].route(
                MATHJAX, lambda asked: asked.fulfill(content_type="text/javascript", body=AS_TYPED)
            )
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
