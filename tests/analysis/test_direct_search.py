"""Direct searches: they find a known best, and every rollout counts."""

import importlib.util

import numpy as np
import pytest

from nmpcrl.analysis.direct_search import SEARCHES, WIDEST, Tried, grid
from nmpcrl.analysis.policy_search import LOWER, SCALE, UPPER
from nmpcrl.study import paper

START = np.array(paper.THETA_INIT)
BEST = START + 0.4 * SCALE
NEEDS_OPTUNA = pytest.mark.skipif(
    not importlib.util.find_spec("optuna"), reason="needs the extra nmpcrl[search]"
)
ALL = [
    pytest.param(one, id=name, marks=NEEDS_OPTUNA if name == "Bayes" else ())
    for name, one in SEARCHES.items()
]
EVERY = [one for one in ALL if one.id != "grid"]


class Bowl:
    """A cost that is 7 at `BEST` and infinite far from it; notes what was asked."""

    def __init__(self):
        self.asked = []

    def __call__(self, theta):
        self.asked.append(np.array(theta))
        away = np.linalg.norm((theta - BEST) / SCALE)
        return 7 + away**2 if away < 3 else np.inf


@pytest.mark.parametrize("budget", [1, 2, 17])
@pytest.mark.parametrize("search", EVERY)
def test_a_search_stops_exactly_at_its_budget_and_begins_at_the_start(search, budget):
    bowl = Bowl()
    found = search(bowl, START, budget, 0)
    assert len(bowl.asked) == budget
    np.testing.assert_allclose(bowl.asked[0], START)
    costs = [Bowl()(theta) for theta in bowl.asked]
    np.testing.assert_array_equal(found, bowl.asked[int(np.argmin(costs))])


@pytest.mark.parametrize("search", ALL)
def test_no_search_leaves_the_box(search):
    bowl = Bowl()
    search(bowl, START, 60, 3)
    assert (np.array(bowl.asked) >= LOWER - 1e-9).all()
    assert (np.array(bowl.asked) <= UPPER + 1e-9).all()


@pytest.mark.parametrize("search", EVERY)
def test_the_same_seed_asks_for_the_same_thetas_and_another_for_others(search):
    bowls = [Bowl() for _ in range(3)]
    for bowl, seed in zip(bowls, (4, 4, 5), strict=True):
        search(bowl, START, 25, seed)
    first, again, other = (np.array(bowl.asked) for bowl in bowls)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize(("name", "part"), [("SPSA", 0.2), ("CMA-ES", 0.05), ("Bayes", 0.6)])
def test_300_rollouts_leave_this_part_of_what_is_to_be_gained(name, part):
    if name == "Bayes":
        pytest.importorskip("optuna")
    found = SEARCHES[name](Bowl(), START, 300, 0)
    assert Bowl()(found) - 7 <= part * (Bowl()(START) - 7)


def test_a_search_that_has_converged_spends_the_rest_from_its_best():
    bowl = Bowl()
    SEARCHES["CMA-ES"](bowl, START, 3000, 0)
    assert len(bowl.asked) == 3000


@pytest.mark.parametrize(("budget", "made"), [(1, 1), (5, 5), (11, 11), (300, 11)])
def test_the_grid_has_eleven_points_over_theta_c_alone(budget, made):
    bowl = Bowl()
    grid(bowl, START, budget)
    asked = np.array(bowl.asked)
    assert len(asked) == made
    assert (asked[:, :-1] == START[:-1]).all()
    if made == 11:
        np.testing.assert_allclose(asked[:, -1], np.linspace(START[-1], WIDEST, 11))


def test_the_grid_finds_the_best_theta_c():
    found = grid(lambda theta: abs(theta[-1] - 0.2), START, 11)
    assert found[-1] == pytest.approx(0.2, abs=0.02)


@pytest.mark.parametrize("search", EVERY)
def test_where_every_rollout_fails_the_start_is_returned(search):
    found = search(lambda theta: np.inf, START, 12, 0)
    np.testing.assert_allclose(found, START)


def test_a_budget_of_nothing_is_refused():
    with pytest.raises(ValueError, match="budget = 0 must be at least 1 rollout"):
        Tried(Bowl(), START, 0)
