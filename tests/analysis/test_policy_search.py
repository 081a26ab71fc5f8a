"""The search: it finds a known best, keeps to its budget, and is made once."""

import tempfile
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from nmpcrl.analysis import policy_search
from nmpcrl.analysis.policy_search import LEAST, SCALE, Found, Search, search_all
from nmpcrl.claims import published
from nmpcrl.learning.rollout import Persistent, evaluate
from nmpcrl.study import ParameterError, StoreError, design, paper

BEST = np.array([0.5, 1.5, 0.1, 0.02, 0.08, 2.0, 0.3, 0.15, 0.3])  # of the bowl below
FOUND = Found(paper.THETA_INIT, 40, (1, 7), (100.0, 80.0))


@pytest.fixture(autouse=True)
def runs(tmp_path, monkeypatch):
    """A folder of this test's own."""
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    return tmp_path


@pytest.fixture
def bowl(monkeypatch):
    """Rollouts whose cost is 7 at `BEST`, grows with the distance, and is infinite far away."""

    def rollout(_, theta, steps):
        away = np.linalg.norm((theta - BEST) / SCALE)
        assert steps == paper.STEPS
        return SimpleNamespace(cost=7 + away**2 if away < 3 else np.inf)

    monkeypatch.setattr(policy_search, "evaluate", rollout)


@pytest.fixture
def searched(monkeypatch, trains_here):
    """The searches that are made from here on, in this process; all find the same."""
    made = []

    def note(wanted):
        made.append(wanted)
        return FOUND

    monkeypatch.setattr(policy_search, "search", note)
    return made


@pytest.mark.parametrize(
    ("name", "nonsense"), [("layout", "Z"), ("seed", -1), ("seed", 0.5), ("budget", LEAST - 1)]
)
def test_a_search_refuses_nonsense_by_name(name, nonsense):
    with pytest.raises(ParameterError, match=rf"{name} = {nonsense!r} must be"):
        replace(Search(), **{name: nonsense})


@pytest.mark.usefixtures("bowl")
def test_the_least_cost_is_found_within_the_budget():
    found = policy_search.search(Search(budget=1500))
    assert found.made <= 1500
    assert found.cost == pytest.approx(7, abs=1e-3)
    np.testing.assert_allclose((np.array(found.theta) - BEST) / SCALE, 0, atol=0.05)


@pytest.mark.usefixtures("bowl")
def test_it_starts_at_theta_init_and_notes_every_improvement():
    found = policy_search.search(Search(budget=200))
    start = np.linalg.norm((paper.THETA_INIT - BEST) / SCALE)
    assert found.rollouts[0] == 1
    assert found.initial == pytest.approx(7 + start**2)
    assert (np.diff(found.rollouts) > 0).all()
    assert (np.diff(found.best) < 0).all()
    assert found.gain == pytest.approx(1 - found.best[-1] / found.best[0])


@pytest.mark.usefixtures("bowl")
def test_the_same_search_finds_the_same_theta_and_another_seed_another():
    short = Search(budget=100)
    assert policy_search.search(short) == policy_search.search(short)
    assert policy_search.search(replace(short, seed=1)).theta != policy_search.search(short).theta


@pytest.mark.usefixtures("bowl")
def test_a_search_begins_as_one_with_a_smaller_budget():
    """So that a build can check a published search by its beginning."""
    long = policy_search.search(Search(budget=300))
    for budget in (LEAST, 100, 200):
        short = policy_search.search(Search(budget=budget))
        assert short.cost == long.after(short.made) > long.cost
    assert long.after(1) == long.initial
    known, other = Search(budget=300), Search("B", budget=300)
    assert policy_search.to_make([known, other], {known: long}) == (
        replace(known, budget=policy_search.CHECK),
        other,
    )


@pytest.mark.slow
def test_the_published_searches_are_those_of_this_code():
    searches = published.load().searches
    assert set(searches) == set(map(Search, design.LAYOUTS))
    found = policy_search.search(Search("D", budget=policy_search.CHECK))
    assert found.cost == pytest.approx(searches[Search("D")].after(found.made), rel=1e-6)


@pytest.mark.usefixtures("bowl")
def test_theta_stays_within_its_bounds(monkeypatch):
    seen, rollout = [], policy_search.evaluate

    def note(controller, theta, steps):
        seen.append(theta)
        return rollout(controller, theta, steps)

    monkeypatch.setattr(policy_search, "evaluate", note)
    policy_search.search(Search(budget=300))
    assert (np.array(seen) >= policy_search.LOWER - 1e-12).all()
    assert (np.array(seen) <= policy_search.UPPER + 1e-12).all()


def test_where_all_rollouts_fail_theta_init_is_what_was_found(monkeypatch):
    monkeypatch.setattr(policy_search, "evaluate", lambda *_: SimpleNamespace(cost=np.inf))
    found = policy_search.search(Search(budget=LEAST))
    assert found.theta == pytest.approx(paper.THETA_INIT)
    assert (found.rollouts, found.best) == ((1,), (np.inf,))


@pytest.mark.slow
def test_a_search_in_processes_costs_what_a_rollout_with_its_theta_costs():
    wanted = Search("D", budget=LEAST)
    found = search_all([wanted], workers=1, progress=False)[wanted]
    controller = Persistent(paper.nmpc("D"))
    rollouts = [
        evaluate(controller, np.array(t), paper.STEPS) for t in (paper.THETA_INIT, found.theta)
    ]
    assert (found.initial, found.cost) == pytest.approx(
        [rollout.cost for rollout in rollouts], rel=1e-9
    )
    assert found.cost < found.initial


def test_what_is_stored_is_read_and_only_the_rest_is_searched_for(searched):
    first, second = Search("A"), Search("A", budget=LEAST)
    assert search_all([first], progress=False) == {first: FOUND}
    assert search_all([second, first], progress=False) == {second: FOUND, first: FOUND}
    assert searched == [first, second]


@pytest.mark.parametrize("what", ["version", "versions", "epochs"])
def test_other_versions_and_epochs_make_old_searches_worthless(searched, monkeypatch, what):
    search_all([Search()], progress=False)
    other = {"version": "0.0", "versions": {"casadi": "0.0"}, "epochs": {"control": 99}}[what]
    monkeypatch.setattr(policy_search, what, lambda *_: other)
    search_all([Search()], progress=False)
    assert len(searched) == 2


def test_a_damaged_file_is_reported_and_searched_again(searched, runs, capsys):
    search_all([Search()], progress=False)
    (runs / "policy_search.json").write_text("{")
    assert search_all([Search()], progress=False) == {Search(): FOUND}
    assert "is damaged" in capsys.readouterr().err
    assert len(searched) == 2


def test_without_a_folder_to_keep_them_in_nothing_is_searched(searched, runs, monkeypatch):
    (runs / "file").write_text("no folder")
    monkeypatch.setenv("NMPCRL_RUNS", str(runs / "file"))
    with pytest.raises(StoreError, match="cannot be a folder"):
        search_all([Search()], progress=False)
    assert searched == []


def test_what_cannot_be_written_is_found_all_the_same(searched, runs, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(runs))
    (runs / "policy_search.json").mkdir()
    assert search_all([Search()], progress=False) == {Search(): FOUND}
