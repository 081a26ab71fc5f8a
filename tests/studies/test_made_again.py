"""Drawn rows of each published investigation, made afresh, are the published ones."""

import numpy as np
import pandas as pd
import pytest
from registered import INVESTIGATIONS

from nmpcrl.claims.investigation import Condition, rounded

DRAWN = 5
CHAOTIC = "other_problems"  # its runs magnify 1e-10 to 1e-4: its own test compares their beginning


@pytest.mark.weekly
@pytest.mark.parametrize(
    "investigation",
    [one for one in INVESTIGATIONS if one.name != CHAOTIC],
    ids=lambda one: one.name,
)
def test_drawn_rows_made_afresh_are_the_published_ones(investigation):
    table = investigation.table()
    order = np.random.default_rng(0).permutation(len(table))[:DRAWN]
    for row in table.iloc[order].to_dict("records"):
        one = Condition(*(row.pop(name) for name in Condition._fields))
        made = investigation.make(one, investigation.conditions(one.part)[one])
        row.pop("seconds", None)
        again = {name: rounded(made[name], investigation.digits) for name in row}
        pd.testing.assert_series_equal(pd.Series(again), pd.Series(row), check_dtype=False)
