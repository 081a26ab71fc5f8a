"""Both halves of a claim about two learners, and which pairs tell the two apart."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims import published
from nmpcrl.claims.halves import halves

LEARNERS = ("DES", "RDES")
BORDERS = {"diverged": 1.5, "had to be stopped": np.finfo(float).max}


def values(**cells: list[tuple[float, float]]) -> pd.DataFrame:
    """The numbers of both learners, a pair a seed; a cell is called by decay and layout."""
    rows = {
        (*reversed(name.split("_")), seed): pair
        for name, pairs in cells.items()
        for seed, pair in enumerate(pairs)
    }
    index = pd.MultiIndex.from_tuples(list(rows), names=["layout", "decay", "seed"])
    return pd.DataFrame(list(rows.values()), index, columns=list(LEARNERS))


def test_both_halves_are_counted_in_every_reading_by_the_claims_own_measure_first():
    found = halves(
        LEARNERS, values(step_A=[(2, 1), (2, np.inf)], step_B=[(1, 1)], episode_B=[(1, 2)]), BORDERS
    )
    assert [(one.wrong, one.decay, one.counts, one.pairs) for one in found] == [
        ("diverged", "step", (2, 1), 3),
        ("diverged", "episode", (0, 1), 1),
        ("had to be stopped", "step", (0, 1), 3),
        ("had to be stopped", "episode", (0, 0), 1),
    ]


def test_a_pair_of_which_one_is_not_known_says_nothing():
    (found, _) = halves(LEARNERS, values(step_A=[(2, np.nan), (2, 1)]), BORDERS)
    assert (found.pairs, found.counts) == (1, (1, 0))


@pytest.mark.parametrize(
    ("pairs", "as_claimed", "against", "p"),
    [
        ([(2, 2)] * 10, 0, 0, 1.0),
        ([(2, 1)] * 4, 4, 0, 0.125),
        ([(1, 2)] * 4 + [(2, 2)], 0, 4, 0.125),
        ([(2, 1), (1, 2)], 1, 1, 1.0),
    ],
)
def test_only_pairs_that_differ_tell_the_learners_apart(pairs, as_claimed, against, p):
    (found, _) = halves(LEARNERS, values(step_A=pairs), BORDERS)
    assert (found.as_claimed, found.against) == (as_claimed, against)
    assert found.p == pytest.approx(p)


def test_c1_is_as_claimed_per_step_and_its_reverse_is_not_shown_per_episode():
    step, episode = published.load().verdict("C1").own_halves
    assert (step.counts, step.as_claimed, step.apart) == ((27, 10), 19, 21)
    assert (episode.counts, episode.as_claimed, episode.apart) == ((30, 38), 7, 22)
    assert (step.p, episode.p) == pytest.approx((0.0002, 0.134), abs=1e-3)
