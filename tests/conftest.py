"""Where things are, and a browser for the tests of the built site."""

import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run"
    " --disable-background-networking --disable-component-update --disable-sync"
)


def missing(reason: str) -> None:
    """Skip a test of the site; where the site must be tested, fail."""
    if os.environ.get("NMPCRL_REQUIRE_BROWSER") or os.environ.get("CI"):
        pytest.fail(f"{reason}, and NMPCRL_REQUIRE_BROWSER or CI is set")
    pytest.skip(reason)


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return ROOT


@pytest.fixture(scope="session")
def site() -> Path:
    """The built book."""
    html = ROOT / "_build/html"
    if not (html / "index.html").exists():
        missing("no book is built: run `make book`")
    return html


@pytest.fixture(scope="session")
def browser():
    """A headless Chromium of the distribution."""
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        missing(f"none of {', '.join(BROWSERS)} is installed")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=FLAGS.split())
        yield chromium
        chromium.close()
