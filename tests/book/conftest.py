"""Pages of the built book, and live figures as a reader finds them."""

import functools
import json
from collections.abc import Callable
from dataclasses import asdict

import pytest
from bs4 import BeautifulSoup
from filelock import FileLock
from visits import EACH_PUSH, Visit, look_at


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
