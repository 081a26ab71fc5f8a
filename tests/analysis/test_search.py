"""Searches: they find a known best, every rollout counts, and a long one begins as a short one."""

import importlib.util
from bisect import bisect
from types import SimpleNamespace

import numpy as np
import pytest

from nmpcrl.analysis import search as searching
from nmpcrl.analysis.search import SCALE, bayesian, cma_es, grid, search, spsa
from nmpcrl.claims import published
from nmpcrl.learning import evaluate
from nmpcrl.study import ParameterError, design, paper
from nmpcrl.study import published as store

START = np.array(paper.THETA_INIT)
BEST = START + 0.4 * SCALE
NEEDS_OPTUNA = pytest.mark.skipif(
    not importlib.util.find_spec("optuna"), reason="needs the extra nmpcrl[search]"
)
EVERY = [spsa, cma_es, pytest.param(bayesian, marks=NEEDS_OPTUNA)]


class Bowl:
    """A cost that is 7 at `BEST` and infinite far from it; records what is asked."""

    def __init__(self):
        self.asked = []

    def __call__(self, theta):
        self.asked.append(np.array(theta))
        away = np.linalg.norm((theta - BEST) / SCALE)
        return 7 + away**2 if away < 3 else np.inf


@pytest.mark.parametrize("budget", [1, 2, 60])
@pytest.mark.parametrize("direct", EVERY)
def test_a_search_begins_at_the_start_stays_in_the_box_and_ends_at_its_budget(direct, budget):
    bowl, again, other = Bowl(), Bowl(), Bowl()
    found = direct(bowl, START, budget, 4)
    assert len(bowl.asked) == budget
    np.testing.assert_allclose(bowl.asked[0], START)
    np.testing.assert_array_equal(found, min(bowl.asked, key=Bowl()))
    asked = np.array(bowl.asked)
    assert ((asked >= searching.LOWER - 1e-9) & (asked <= searching.UPPER + 1e-9)).all()
    direct(again, START, budget, 4), direct(other, START, budget, 5)
    np.testing.assert_array_equal(again.asked, asked)
    assert budget < 3 or not np.array_equal(other.asked, asked)
    np.testing.assert_allclose(direct(lambda theta: np.inf, START, budget, 0), START)


@pytest.mark.parametrize(
    ("direct", "part"),
    [(spsa, 0.2), (cma_es, 0.05), pytest.param(bayesian, 0.6, marks=NEEDS_OPTUNA)],
)
def test_300_rollouts_leave_a_part_of_the_possible_gain(direct, part):
    assert Bowl()(direct(Bowl(), START, 300, 0)) - 7 <= part * (Bowl()(START) - 7)


@pytest.mark.parametrize(("budget", "made"), [(1, 1), (5, 5), (11, 11), (300, 11)])
def test_the_grid_has_eleven_points_over_theta_c_alone(budget, made):
    bowl, expected = Bowl(), np.tile(START, (11, 1))
    grid(bowl, START, budget)
    expected[:, -1] = np.linspace(START[-1], searching.WIDEST, 11)
    np.testing.assert_allclose(bowl.asked, expected[:made])
    best = grid(lambda theta: abs(theta[-1] - 0.2), START, 11)
    assert best[-1] == pytest.approx(0.2, abs=0.02)


@pytest.fixture
def bowl(monkeypatch):
    """A `Bowl` in the place of rollouts."""
    made = Bowl()
    monkeypatch.setattr(searching, "evaluate", lambda _, one, __: SimpleNamespace(cost=made(one)))
    return made


def test_a_search_refuses_nonsense_by_name():
    with pytest.raises(ParameterError, match="layout = 'Z' must be"):
        search("Z")
    with pytest.raises(ValueError, match="budget = 0 must be at least 1 rollout"):
        grid(Bowl(), START, 0)


def test_the_least_cost_is_found_and_a_search_begins_as_one_with_a_smaller_budget(
    bowl, monkeypatch
):
    found = search("A", 1500)
    assert len(bowl.asked) == found.made <= 1500
    assert found.cost == pytest.approx(7, abs=1e-3)
    np.testing.assert_allclose((np.array(found.theta) - BEST) / SCALE, 0, atol=0.05)
    assert (found.rollouts[0], found.initial) == (1, Bowl()(START))
    assert (np.diff(found.rollouts) > 0).all()
    assert (np.diff(found.best) < 0).all()
    long = search("A", 300)
    for budget in (40, 100, 200):
        short = search("A", budget)
        assert short.cost == long.best[bisect(long.rollouts, short.made) - 1] > long.cost
    assert search("A", 100, seed=1).theta != search("A", 100).theta
    monkeypatch.setattr(searching, "evaluate", lambda *_: SimpleNamespace(cost=np.inf))
    failed = search("A", 40)
    assert failed == searching.SearchResult(paper.THETA_INIT, failed.made, (1,), (np.inf,))


@pytest.mark.slow
def test_the_published_searches_are_those_of_this_code_and_cost_what_a_rollout_costs():
    known = published.load().searches
    assert [*known] == [*design.LAYOUTS]
    if not store.is_current(published.SEARCHES):
        pytest.skip("the published searches are of earlier epochs")
    found = search("D", 200)
    best = known["D"].best[bisect(known["D"].rollouts, found.made) - 1]
    assert found.cost == pytest.approx(best, rel=1e-6)
    cost = evaluate(paper.nmpc("D"), np.array(found.theta), paper.STEPS).cost
    assert found.cost == pytest.approx(cost, rel=1e-9)
