"""Both halves of a claim about two learners, and where the runs say the reverse of it."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims.halves import confirmations, halves, reversals
from nmpcrl.claims.verdict import WHOLE

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


def test_both_halves_are_counted_in_every_reading_and_layout():
    found = halves(LEARNERS, values(step_A=[(2, 1), (2, np.inf)], step_B=[(1, 1)]), BORDERS)
    cells = {(one.wrong, one.layouts): one.counts for one in found}
    assert cells == {
        ("diverged", (WHOLE,)): (2, 1),
        ("diverged", ("A",)): (2, 1),
        ("diverged", ("B",)): (0, 0),
        ("had to be stopped", (WHOLE,)): (0, 1),
        ("had to be stopped", ("A",)): (0, 1),
        ("had to be stopped", ("B",)): (0, 0),
    }


def test_a_pair_of_which_one_is_not_known_says_nothing():
    found = halves(LEARNERS, values(step_A=[(2, np.nan), (2, 1)]), BORDERS)
    assert found[0].pairs == 1
    assert found[0].counts == (1, 0)


def test_pairs_in_which_both_went_wrong_tell_nothing_apart():
    both = halves(LEARNERS, values(step_A=[(2, 2)] * 10), BORDERS)
    assert not list(reversals(both))
    assert not list(confirmations(both))


@pytest.mark.parametrize(("pairs", "reverse"), [(3, False), (4, True)])
def test_the_reverse_needs_an_interval_above_one_half(pairs, reverse):
    found = list(reversals(halves(LEARNERS, values(step_A=[(1, 2)] * pairs), BORDERS)))
    assert bool(found) == reverse


def test_what_is_claimed_is_no_reverse():
    found = halves(LEARNERS, values(step_A=[(2, 1)] * 10, step_B=[(2, 2)] * 10), BORDERS)
    assert not list(reversals(found))
    (one,) = confirmations(found)
    assert (one.layouts, one.counts, one.pairs, one.against, one.apart) == (
        (WHOLE,),
        (20, 10),
        20,
        0,
        10,
    )


def test_the_reverse_is_no_confirmation():
    assert not list(confirmations(halves(LEARNERS, values(step_A=[(1, 2)] * 10), BORDERS)))


def test_where_a_whole_reading_is_undecided_its_reversed_layouts_are_named_together():
    cells = {
        "episode_A": [(2, 1)] * 9,
        "episode_B": [(1, 2)] * 6,
        "episode_C": [(1, 2)] * 5,
        "step_B": [(2, 1)] * 6,
    }
    (one,) = reversals(halves(LEARNERS, values(**cells), BORDERS))
    assert one.layouts == ("B", "C")
    assert (one.counts, one.pairs, one.against, one.apart) == ((0, 11), 11, 11, 11)


def test_a_reversal_of_a_whole_reading_is_said_of_all_layouts():
    (one,) = reversals(halves(LEARNERS, values(step_A=[(1, 2)] * 9, step_B=[(1, 1)]), BORDERS))
    assert one.layouts == (WHOLE,)
    assert one.counts == (0, 9)
