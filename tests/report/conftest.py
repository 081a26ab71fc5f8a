"""What is asked of every figure."""

from collections.abc import Callable

import pytest
from matplotlib.figure import Figure

COUNTED = ("episode", "episodes trained", "noise-free RL cost", "relative")  # have no unit


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
