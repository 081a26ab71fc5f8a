"""The runs of worlds that change: each once, within the price, and whole arms alone are told of."""

import pytest

from nmpcrl.claims import world_runs
from nmpcrl.claims.world_questions import PARTS, REMEDY
from nmpcrl.claims.world_runs import COLUMNS, KEPT, NoRemedy, Ran, planned, price, wanted, whole


@pytest.fixture(autouse=True)
def quick(tmp_path, monkeypatch, trains_here):
    """Nothing is run."""
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "published"))
    monkeypatch.setattr(world_runs, "run", lambda one: Ran(cost=float(one.budget), seconds=2.0))
    monkeypatch.setattr(world_runs, "compile_ahead", lambda missing: None)


def test_all_that_is_run_is_planned_once_and_takes_at_most_four_hours_of_one_core():
    runs = [one for part in PARTS for one in planned(part)]
    assert len({*runs}) == len(runs)
    assert price(runs, {}) < 4 * 3600


def test_the_arms_of_a_seed_meet_the_same_noise():
    by = {}
    for one in planned("random"):
        by.setdefault(one.entry, []).append((one.layout, one.seed, one.budget))
    first, *others = by.values()
    assert all(one == first for one in others)


def test_the_part_with_a_remedy_waits_for_the_comparison_of_them(monkeypatch):
    with pytest.raises(NoRemedy, match="the part 'once' has the remedy to try first"):
        wanted("once")
    assert wanted("random")
    monkeypatch.setattr(world_runs, "remedy", lambda: "grid")
    assert f"once: {REMEDY} grid" in {one.entry for one in wanted("once")}


def test_what_is_kept_comes_as_a_table_and_what_is_not_whole_does_not():
    world_runs.run_parts(["gradient"], progress=False, workers=1)
    found = whole(["gradient", "moving"])
    assert [*found.columns] == [*COLUMNS]
    assert len(found) == 60
    assert {*found.k} == {0}
    KEPT.path_of(wanted("gradient")[0]).unlink()
    assert {*whole(["gradient"]).arm} == {"0.05", "0.1"}


def test_the_price_is_that_of_the_same_arm():
    world_runs.run_parts(["gradient"], progress=False, workers=1)
    runs = wanted("gradient")
    assert price(runs[:3], KEPT.stored(runs)) == 3 * 2.0
