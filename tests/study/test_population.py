"""The population: as many layouts as were agreed, drawn and screened as the module says."""

from itertools import islice

import pytest

from nmpcrl.study import paper, population
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.layouts import screen
from nmpcrl.study.population import JUDGE, LAYOUTS, TUNE


def test_60_layouts_are_there_to_tune_on_and_120_to_judge_on():
    assert (len(TUNE), len(JUDGE)) == (60, 120)
    assert tuple(LAYOUTS) == (*TUNE, *JUDGE) == population.names()
    assert {"T01", "T60"} < TUNE.keys()
    assert {"J001", "J120"} < JUDGE.keys()


def test_no_layout_is_there_twice_or_is_a_named_one():
    assert len({*LAYOUTS.values(), *paper.LAYOUTS.values()}) == 180 + len(paper.LAYOUTS)


def test_the_first_layouts_are_drawn_again():
    assert [*islice(population.drawn(), 6)] == [*LAYOUTS.values()][:6]


@pytest.mark.parametrize("name", ["T60", "J001", "J120"])
def test_a_layout_passes_the_screening(name):
    assert screen(LAYOUTS[name]).passed


@pytest.mark.weekly
@pytest.mark.slow
def test_every_layout_is_drawn_again():
    assert dict(zip(population.names(), population.drawn(), strict=False)) == LAYOUTS


def test_what_is_written_is_what_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(population, "PLACE", tmp_path / "population.json")
    monkeypatch.setattr(population, "drawn", lambda: iter(LAYOUTS.values()))
    assert population.write() == tmp_path / "population.json"
    assert population.load() == LAYOUTS


def test_an_experiment_takes_a_layout_of_the_population_by_its_centres():
    experiment = Experiment(layout=JUDGE["J001"])
    assert paper.centres_of(experiment.layout) == JUDGE["J001"]
