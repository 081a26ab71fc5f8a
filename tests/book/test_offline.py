"""What an edition holds so that its notebooks need not train for long."""

import nbformat
import pytest
from driver.course import course, offline
from nbformat.v4 import new_code_cell, new_notebook

from nmpcrl.analysis import summaries
from nmpcrl.study import Experiment, store

ASKS = """from nmpcrl.study import Experiment

experiments = (Experiment("ES", episodes=1), Experiment(study, episodes=1))
summaries = (Experiment("frozen", episodes=length),) * 2"""


@pytest.fixture
def chapter(tmp_path, monkeypatch) -> str:
    """A chapter that needs two runs, and the summary of a third."""
    cells = [
        new_code_cell('study = "fresh"\nlength = 2\nseeds = [0]', metadata={"tags": ["parameters"]})
    ]
    cells.append(new_code_cell(ASKS))
    (tmp_path / "book").mkdir()
    about = nbformat.read(next((course.ROOT / "book").glob("*.ipynb")), 4).metadata
    notebook = new_notebook(cells=cells, metadata=about)
    nbformat.write(notebook, tmp_path / "book/asks.ipynb")
    monkeypatch.setattr(offline, "ROOT", tmp_path)
    monkeypatch.setattr(offline.editions, "OFFLINE", {"study": "GES", "length": 1, "budget": 3})
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    return "asks.ipynb"


def test_long_runs_and_all_summaries_are_taken_with_the_parameters_of_the_editions(
    chapter, monkeypatch
):
    long, frozen = Experiment("GES", episodes=1), Experiment("frozen", episodes=1)
    assert offline.needed([chapter]) == ((), (frozen,))
    monkeypatch.setattr(offline, "LONG", 0)
    assert offline.needed([chapter]) == ((Experiment("ES", episodes=1), long), (frozen,))


@pytest.mark.usefixtures("trains_here")
def test_what_is_missing_is_trained_and_an_edition_reads_it(chapter, tmp_path, monkeypatch):
    monkeypatch.setattr(offline, "LONG", 0)
    found = offline.stored([chapter])
    place = tmp_path / "student"
    offline.copy(found, place)
    monkeypatch.setenv("NMPCRL_RUNS", str(place / "data/runs"))
    assert store.RUNS.read(Experiment("GES", episodes=1)).steps["cost"].size
    assert summaries.SUMMARIES.read(Experiment("frozen", episodes=1)).episodes["cost"].size
    assert len([path for path in place.rglob("*") if path.is_file()]) == len(found) == 3


def test_runs_with_networks_are_taken_and_those_without_are_not():
    whole, summarised = offline.needed(course.chapters())
    assert {one.learner for one in whole} == {"DES", "RDES"}
    assert {one.learner for one in summarised} > {"ES", "GES", "TDC"}
