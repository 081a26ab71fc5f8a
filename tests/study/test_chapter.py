"""What a chapter is given, checked in its second cell."""

import sys
from types import SimpleNamespace

import pytest

from nmpcrl.study import Experiment, ParameterError, chapter
from nmpcrl.study.sweeps import FIELDS

PARAMETERS = {"episodes": 300, "seeds": [0, 1], "layout": "A", "budget": "checked elsewhere"}


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


def test_what_is_allowed_passes_outside_of_a_notebook_too():
    chapter.check(**PARAMETERS)
    chapter.check(**PARAMETERS | {"layout": [[0.5, 2.2], [3, 0.5]]})


ON_START = (
    "has an obstacle on the robot's start, (-2.5, 1.5): each centre must be 1.25 m or more away"
    " from it in a chapter"
)
ON_TARGET = ON_START.replace("start, (-2.5, 1.5)", "target, (8.5, 2)")
NEVER = (
    "has an obstacle where the robot never comes, (3, 9.5): each centre must be in its box,"
    " [-3, 9] x [-3, 9], in a chapter"
)
AT_ONCE = "with larger ones a run ends before there is anything to show"


@pytest.mark.parametrize(
    ("name", "given", "said"),
    [
        ("episodes", 10**8, "episodes = 100000000 must be a whole number from 1 to 100000"),
        ("episodes", "300", "episodes = '300' must be a whole number from 1 to 100000"),
        ("layout", ["A"], f"layout = ['A'] must be {FIELDS['layout'].text}"),
        ("layout", [[3, 4], [-2.5, 0.5]], f"layout = [[3, 4], [-2.5, 0.5]] {ON_START}"),
        ("layout", [[8, 2]], f"layout = [[8, 2]] {ON_TARGET}"),
        ("layouts", ["A", [[3, 4]]], "layout = [[3, 4]] must be one of A, B, C, D, E, F"),
        ("layout", [[3, 4], [3, 9.5]], f"layout = [[3, 4], [3, 9.5]] {NEVER}"),
        ("seeds", 3, "seeds = 3 must be a list, such as [3]"),
        ("seeds", [-1], "seed = -1 must be a whole number from 0 to 2147483647"),
        ("alpha", 1e3, f"alpha = 1000 must be at most 1e-05 in a chapter: {AT_ONCE}"),
        ("beta", 1.0, f"beta = 1 must be at most 0.0001 in a chapter: {AT_ONCE}"),
    ],
)
def test_a_value_that_may_not_be_is_refused(name, given, said):
    assert refusal(**PARAMETERS | {name: given}) == said


def test_a_name_that_papermill_set_and_the_chapter_does_not_declare_is_refused(session):
    session("episodes = 300", "# Parameters\nepisode = 2\n", "chapter.check()")
    assert refusal(**PARAMETERS) == (
        "this chapter has no parameter 'episode' (did you mean 'episodes'?);"
        " it has episodes, seeds, layout, budget"
    )


def test_a_name_like_no_other_is_refused_without_a_suggestion(session):
    session('# Parameters\nopen = "x"\nepisodes = 2\n')
    assert refusal(**PARAMETERS).startswith("this chapter has no parameter 'open'; it has")


@pytest.mark.parametrize(
    "cells",
    [
        ("episodes = 300", "# Parameters\nepisodes = 2\nseeds = [3]\n"),
        ("# Parameters\n",),
        ('# Parameters\nPAPERMILL_INPUT_PATH = "in.ipynb"\n',),
        ("# Parameters\nepisode = 2\n", "# Parameters\nepisodes = 2\n"),  # it was corrected
        ("episode = 2", "# Parameter\nfigure = 2\n", "%matplotlib inline", "further = [1, 2]"),
    ],
)
def test_what_a_reader_or_papermill_sets_besides_is_no_parameter(session, cells):
    session(*cells)
    chapter.check(**PARAMETERS)
    chapter.check(**PARAMETERS | {"layout": [[0.5, 2.2], [3, 0.5]]})


def test_days_of_training_are_refused(monkeypatch):
    runs = [Experiment("RDES", seed=seed, episodes=20_000) for seed in range(100)]
    with pytest.raises(ParameterError, match="more with NMPCRL_YES=1 in the environment"):
        chapter.afford(runs)
    monkeypatch.setenv("NMPCRL_YES", "1")
    chapter.afford(runs)


def test_a_page_without_parameters_refuses_all(session):
    session("# Parameters\nepisodes = 2\n")
    assert refusal() == "this chapter has no parameter 'episodes'; it has none"
