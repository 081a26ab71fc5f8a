"""The runs of SAC and TD3: each once, within the price, tuned before they are judged."""

import sys

import numpy as np
import pytest

from nmpcrl.analysis.agents import NoAgents
from nmpcrl.claims import agent_published, agent_runs
from nmpcrl.claims.agent_published import COLUMNS
from nmpcrl.claims.agent_questions import AGENTS, EVERY, PARTS, SETTINGS
from nmpcrl.claims.agent_runs import (
    KEPT,
    Curve,
    NotTuned,
    chosen,
    judged_in,
    planned,
    price,
    settings,
    sparing,
    wanted,
    whole,
)
from nmpcrl.study.drawn import JUDGE, TUNE

BEST = 2  # which setting costs least here


def ran(one):
    """A training that comes to as much as its setting is far from the best one."""
    part, _, name = one.entry.partition(": ")
    agent = name.partition("[")[0]
    known = settings(agent)
    cost = 100.0 + abs(known.index(name) - BEST) if name in known else 90.0
    layouts, points = len(judged_in(one.layout)), len(PARTS[part].checkpoints)
    costs = [[cost] * layouts] * points
    return Curve([100.0] * layouts, costs, ["a" * layouts] * points, one.budget, 1, 2.0)


@pytest.fixture(autouse=True)
def quick(tmp_path, monkeypatch, trains_here):
    """Nothing is trained, and nothing is published."""
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    monkeypatch.setattr("nmpcrl.claims.extendable.place", lambda: tmp_path / "published")
    monkeypatch.setattr(agent_runs, "run", ran)
    monkeypatch.setattr(agent_runs, "require", lambda: None)


def test_all_that_is_run_is_planned_once_and_takes_at_most_two_and_a_half_hours_of_one_core():
    runs = [one for part in PARTS for one in planned(part)]
    assert len({*runs}) == len(runs)
    assert price(runs, {}) < 2.5 * 3600


def test_an_agent_is_judged_with_the_setting_that_costs_least_and_not_before_it_is_known():
    for part in PARTS:
        if part != "tune":
            with pytest.raises(NotTuned, match="nmpcrl agents --part tune"):
                wanted(part)
    agent_runs.run_parts(["judge", "tune"], progress=False, workers=1)
    names = {agent: settings(agent)[BEST] for agent in AGENTS}
    assert {agent: chosen(agent) for agent in AGENTS} == names
    assert {one.entry for one in wanted("judge")} == {f"judge: {name}" for name in names.values()}
    assert len(SETTINGS["SAC"]) * 3 * len(AGENTS) == len(wanted("tune"))


def test_a_published_tuning_is_as_good_as_one_that_is_kept():
    agent_runs.run_parts(["tune"], progress=False, workers=1)
    names = {agent: chosen(agent) for agent in AGENTS}
    agent_published.extend(whole(["tune"]))
    for path in {KEPT.path_of(one) for one in wanted("tune")}:
        path.unlink()
    assert {agent: chosen(agent) for agent in AGENTS} == names


def test_the_long_parts_have_fewer_gradient_steps():
    assert sparing("SAC") == "SAC[gradient=0.5]"
    assert sparing("TD3[gradient=0.25,width=32]") == "TD3[gradient=0.25,width=32]"
    assert {one.entry for one in planned("all")} == {
        "all: SAC[gradient=0.5]", "all: TD3[gradient=0.5]",
    }  # fmt: skip


def test_one_agent_for_all_is_judged_in_layouts_that_it_never_saw():
    assert {*agent_runs.trained_in(EVERY)} == {*TUNE}
    assert {*judged_in(EVERY)} == {*TUNE, *JUDGE}
    assert {*judged_in("J001")} == {*agent_runs.trained_in("J001")} == {"J001"}


def test_what_is_kept_comes_as_a_table_and_what_is_not_whole_does_not():
    agent_runs.run_parts(["tune"], progress=False, workers=1)
    found = whole(["tune", "one"])
    assert [*found.columns] == [*COLUMNS]
    assert len(found) == 24
    assert {*found.k} == {0}
    KEPT.path_of(wanted("tune")[0]).unlink()
    assert len(whole(["tune"])) == 21


def test_the_price_is_that_of_the_same_arm():
    agent_runs.run_parts(["tune"], progress=False, workers=1)
    runs = wanted("tune")
    assert price(runs[:3], KEPT.stored(runs)) == 3 * 2.0


def test_a_run_is_the_curve_of_its_part(monkeypatch):
    monkeypatch.undo()
    monkeypatch.setattr(agent_runs, "curve", lambda *given: given)
    name, trained, judged, checkpoints, seed = agent_runs.run(planned("judge")[0])
    assert (name, [*trained], [*judged]) == ("SAC", ["J001"], ["J001"])
    assert checkpoints == PARTS["judge"].checkpoints
    assert np.isfinite(seed)


def test_without_the_extra_nothing_is_begun(monkeypatch, tmp_path):
    monkeypatch.undo()
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(NoAgents, match=r"nmpcrl\[agents\]"):
        agent_runs.run_parts(["tune"], progress=False, workers=1)
