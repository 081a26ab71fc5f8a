"""What is asked of every figure, and what a live one is given."""

import inspect
import json
import re
from collections.abc import Callable, Iterator

import pytest
from legibility import flaws
from matplotlib.figure import Figure

from nmpcrl.report.figures import sheet

COUNTED = ("episode", "episodes trained", "noise-free RL cost", "relative")  # have no unit


@pytest.fixture(scope="session")
def seen() -> set[str]:
    """The functions whose figures were looked at."""
    return set()


@pytest.fixture(autouse=True)
def legible(seen, monkeypatch) -> Iterator[None]:
    """Whatever the first test of a function draws can be read."""
    drawn: list[Figure] = []
    finish = sheet._finished

    def noted(figure: Figure) -> Figure:
        name = inspect.stack()[1].frame.f_locals["draw"].__qualname__
        if name not in seen:
            seen.add(name)
            drawn.append(figure)
        return finish(figure)

    monkeypatch.setattr(sheet, "_finished", noted)
    yield
    for figure in drawn:
        assert not flaws(figure)


@pytest.fixture(scope="session")
def source_of() -> Callable[[Figure], str]:
    """Where a figure says that its runs come from."""

    def said(figure: Figure) -> str:
        title = figure.legends[0].get_title().get_text() if figure.legends else ""
        return " ".join((title or figure.get_supxlabel()).split())

    return said


@pytest.fixture(scope="session")
def texts() -> Callable[[Figure], str]:
    """All titles of a figure."""

    def titles(figure: Figure) -> str:
        above = figure.get_suptitle()
        return " ".join([above, *(axes.get_title(loc="left") for axes in figure.axes)])

    return titles


@pytest.fixture(scope="session")
def assert_readable(texts) -> Callable[[Figure], None]:
    """A title, labels with a unit where there is a quantity, and it renders."""

    def check(figure: Figure) -> None:
        figure.canvas.draw()
        assert texts(figure).strip()
        labels = [label for a in figure.axes for label in (a.get_xlabel(), a.get_ylabel()) if label]
        assert len(labels) >= 2
        for label in labels:
            assert "[" in label or "(no unit)" in label or label.endswith(COUNTED), label

    return check


@pytest.fixture
def data(shown) -> dict:
    """What the script of a live figure is given, whose HTML is `shown`."""
    return json.loads(re.search(r'application/json">(.*)</script>', shown)[1])
