"""Where things are, a browser for the tests of the built site, and times that nobody measured."""

import os
import shutil
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import builders
import numba
import numpy as np
import pandas as pd
import pytest
import tenths
from hypothesis import settings

from nmpcrl.control import differential_drive
from nmpcrl.study import jobs, paper

settings.register_profile("fixed", deadline=None, derandomize=True)  # the machine may be busy
settings.register_profile("random", deadline=None, derandomize=False, print_blob=True)
settings.load_profile(os.environ.get("NMPCRL_EXAMPLES", "fixed"))

ROOT = Path(__file__).resolve().parent.parent
NEEDS = {  # fixture -> the markers of a test that asks for it, directly or through others
    "site": "built",
    "browser": "browser",
    "distributed_firefox": "browser weekly",
    "jupyter_lab": "lab",
}
RUNS = Path(os.environ.get("NMPCRL_RUNS") or ROOT / "runs")  # before a test names others
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run"
    " --disable-background-networking --disable-component-update --disable-sync"
)


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--tenth 3`, or `--tenth today`: of the tests that are asked for, those of one tenth."""
    parser.addoption("--tenth", help="run one tenth of the tests: 0 to 9, or today")


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Settle which tenth is meant before workers start, and midnight comes."""
    if config.option.tenth is not None:
        config.option.tenth = str(tenths.asked(config.option.tenth))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave the tests of other tenths out."""
    if config.option.tenth is not None:
        chosen, _ = map(set, tenths.split((one.nodeid for one in items), int(config.option.tenth)))
        config.hook.pytest_deselected(items=[one for one in items if one.nodeid not in chosen])
        items[:] = [one for one in items if one.nodeid in chosen]


def pytest_report_header(config: pytest.Config) -> str | None:
    """Which tenth it is, so that it can be run again."""
    return None if config.option.tenth is None else f"--tenth {config.option.tenth}"


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark a test with what it needs, so that none can forget to say so."""
    for fixture in NEEDS.keys() & set(getattr(item, "fixturenames", ())):
        for marker in NEEDS[fixture].split():
            item.add_marker(marker)


def missing(reason: str) -> None:
    """Skip a test of the site; where the site must be tested, fail."""
    if os.environ.get("NMPCRL_REQUIRE_BROWSER") or os.environ.get("CI"):
        pytest.fail(f"{reason}, and NMPCRL_REQUIRE_BROWSER or CI is set")
    pytest.skip(reason)


@pytest.fixture(scope="session")
def nobodys(tmp_path_factory) -> Iterator[Path]:
    """Where a run is stored whose test names no folder: never among the user's own."""
    folder = tmp_path_factory.mktemp("nobodys") / "runs"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NMPCRL_RUNS", str(folder))
        yield folder


@pytest.fixture(autouse=True)
def stores_in_a_folder_of_its_own(nobodys) -> Iterator[None]:
    """A test that stores runs says where; otherwise it would read what another has stored."""
    yield
    assert not nobodys.exists(), "set NMPCRL_RUNS to a folder of this test's own"


@pytest.fixture
def interpreted(tmp_path, monkeypatch) -> Iterator[None]:
    """Python runs what numba would compile: slower, and at once for any number of problems.

    Only in the test that asks for it: what comes after it in its module may be about machine code.
    """
    for name in [one for one in sys.modules if one.startswith("riccati_")]:
        monkeypatch.delitem(sys.modules, name)  # machine code, until the test has ended
    monkeypatch.setattr(numba.config, "DISABLE_JIT", True)
    monkeypatch.setenv("NMPCRL_CACHE", str(tmp_path / "interpreted"))
    with np.errstate(all="ignore"):
        yield
    for name in [one for one in sys.modules if one.startswith("riccati_")]:
        del sys.modules[name]


@pytest.fixture(scope="session")
def shared(tmp_path_factory) -> Path:
    """A folder that the workers of a session have in common."""
    own = tmp_path_factory.getbasetemp()
    return own.parent if "PYTEST_XDIST_WORKER" in os.environ else own


@pytest.fixture
def runs(tmp_path, monkeypatch) -> Path:
    """A folder of this test's own."""
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    return tmp_path / "runs"


@pytest.fixture
def trains_here(monkeypatch) -> None:
    """Where nobody names an executor, jobs are done in a thread: no process has to start."""
    monkeypatch.setattr(jobs, "processes", lambda _: ThreadPoolExecutor(1))


@pytest.fixture(scope="session")
def site() -> Path:
    """The built book."""
    html = ROOT / "_build/html"
    if not (html / "index.html").exists():
        missing("no book is built: run `make book`")
    return html


@pytest.fixture(scope="session")
def playwright():
    """What drives browsers, once for a session."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as started:
        yield started


def launched(kind, names: tuple[str, ...], **settings):
    """A headless browser of the distribution."""
    path = next(filter(None, map(shutil.which, names)), None)
    if path is None:
        missing(f"none of {', '.join(names)} is installed")
    return kind.launch(executable_path=path, **settings)


@pytest.fixture(scope="session")
def browser(playwright):
    """A headless Chromium of the distribution."""
    chromium = launched(playwright.chromium, BROWSERS, args=FLAGS.split())
    yield chromium
    chromium.close()


@pytest.fixture(scope="session")
def distributed_firefox(playwright):
    """A headless Firefox of the distribution, not of Playwright's own making."""
    firefox = launched(playwright.firefox, ("firefox-esr", "firefox"), channel="moz-firefox")
    yield firefox
    firefox.close()


@pytest.fixture(scope="session")
def jupyter_lab() -> str:
    """The command of the JupyterLab that `make lab` installs."""
    path = ROOT / ".venv-lab/bin/jupyter"
    if not path.exists():
        missing("no JupyterLab is installed: run `make .venv-lab/ready`")
    return str(path)


@pytest.fixture(scope="session")
def robot_module() -> bytes:
    """The robot's controller and the update rules as WebAssembly; a minute to make, once."""
    from nmpcrl.learning import browser

    return browser.module(differential_drive(), paper.task("A"))


@pytest.fixture
def timings() -> pd.DataFrame:
    """Times that nobody measured, with each solver."""
    return builders.timings(width=0.01, solvers=tuple(builders.SOLVERS))
