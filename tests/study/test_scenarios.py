"""The scenarios: as many as were agreed, drawn and screened as the module says."""

from collections import Counter
from itertools import islice

import pytest

from nmpcrl.study import scenarios
from nmpcrl.study.motions import still
from nmpcrl.study.scenarios import COUNT, accepted, load, sampler


def test_there_are_forty_and_no_two_are_alike():
    assert len({*load().values()}) == COUNT == 40
    assert list(load())[::39] == ["M01", "M40"]
    assert {*Counter(map(len, load().values()))} == {3, 4, 5, 6}


def test_they_are_drawn_in_this_order():
    drawn = [*islice(sampler(), 60)]
    where = [drawn.index(one) for one in load().values() if one in drawn]
    assert where == sorted(where)
    assert len(where) == COUNT


def test_a_scenario_that_covers_the_start_or_blocks_nothing_is_refused():
    assert not accepted(still([(-2.5, 1.5), (3.0, 4.9), (3.0, -1.5), (5.0, -1.5)]))
    assert not accepted(still([(3.0, 4.9), (0.0, 4.9), (5.0, -1.5), (3.0, -1.5)]))


@pytest.mark.parametrize("name", ["M02", "M40"])
@pytest.mark.slow
def test_a_scenario_passes_the_screening(name):
    assert accepted(load()[name])


@pytest.mark.slow
def test_every_scenario_is_drawn_again(tmp_path, monkeypatch):
    there = load()
    monkeypatch.setattr(scenarios, "PLACE", tmp_path / "scenarios.json")
    scenarios.write()
    load.cache_clear()
    assert load() == there
    load.cache_clear()
