"""The parameters of a chapter, checked in its second cell."""

import sys
from types import SimpleNamespace

import pytest

from nmpcrl.study import ParameterError, chapter

PARAMETERS = {"episodes": 300, "seeds": [0, 1], "layout": "A", "budget": "checked elsewhere"}
NAMES = "episodes, seeds, layout, budget"


@pytest.fixture
def session(monkeypatch):
    """A notebook in which these cells were run."""

    def begin(*cells: str) -> None:
        shell = SimpleNamespace(history_manager=SimpleNamespace(input_hist_raw=["", *cells]))
        ipython = SimpleNamespace(get_ipython=lambda: shell)
        monkeypatch.setitem(sys.modules, "IPython", ipython)

    return begin


def refusal(**declared) -> str:
    with pytest.raises(ParameterError) as caught:
        chapter.check(**declared)
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "given", "said"),
    [
        ("episodes", "300", "episodes = '300' must be a whole number from 1 to 100000"),
        ("layout", [[3, 4], [-2.5, 0.5]], "away from the robot's start, (-2.5, 1.5), and target"),
        ("layout", [[3, 4], [3, 9.5]], "layout = [[3, 4], [3, 9.5]] must, in a chapter, have"),
        ("seeds", 3, "seeds = 3 must be a list, such as [3]"),
        ("alpha", 1e3, "alpha = 1000 must be at most 1e-05 in a chapter"),
    ],
)
def test_a_value_that_is_not_allowed_is_refused(name, given, said):
    assert said in refusal(**PARAMETERS | {name: given})


@pytest.mark.parametrize(
    ("cell", "declared", "said"),
    [
        ("episode = 2", PARAMETERS, "'episode' (did you mean 'episodes'?); it has " + NAMES),
        ("episodes = 2", {}, "'episodes'; it has none"),
    ],
)
def test_a_name_that_papermill_set_and_the_chapter_lacks_is_refused(session, cell, declared, said):
    session("episodes = 300", f"# Parameters\n{cell}\n", "chapter.check()")
    assert refusal(**declared) == f"this chapter has no parameter {said}"


@pytest.mark.parametrize(
    "cells",
    [
        ("episodes = 300", "# Parameters\nepisodes = 2\nseeds = [3]\n"),
        (),
        ('# Parameters\nPAPERMILL_INPUT_PATH = "in.ipynb"\n',),
        ("# Parameters\nepisode = 2\n", "# Parameters\nepisodes = 2\n"),  # it was corrected
        ("episode = 2", "# Parameter\nfigure = 2\n", "%matplotlib inline", "further = [1, 2]"),
    ],
)
def test_other_names_and_allowed_values_pass(session, cells):
    session(*cells)
    chapter.check(**PARAMETERS)
    chapter.check(**PARAMETERS | {"layout": [[0.5, 2.2], [3, 0.5]]})
