"""Drawn rows of each published investigation, made afresh, are the published ones.

On the machine that made them, all are. Elsewhere learning may magnify a last bit (of 21 more rows
of `worlds`, 6 differed), and rows of networks and of `other_problems` are left out. A part is asked
once its published rows are of the present epochs.
"""

import numpy as np
import pandas as pd
import pytest
from history import INVESTIGATIONS

from nmpcrl.studies.investigation import Condition, rounded
from nmpcrl.studies.population import experiments
from nmpcrl.study import published
from nmpcrl.study.learners import LEARNERS
from nmpcrl.study.machine import fingerprint

DRAWN = 5
PRICE = ("seconds", "iterations", "restarts")  # other where a solver starts otherwise
CHAOTIC = "other_problems"  # its runs magnify 1e-10 to 1e-4: its own test compares their beginning


def is_repeatable(investigation, table):
    """Whether each row has the same numbers here as where it was made."""
    if investigation.name == CHAOTIC:
        return np.zeros(len(table), bool)
    if investigation.name == "population":  # a network's products round otherwise elsewhere
        return np.array([not LEARNERS[one.learner].network for one in experiments(table)], bool)
    return np.ones(len(table), bool)


@pytest.mark.weekly
@pytest.mark.parametrize("investigation", INVESTIGATIONS, ids=lambda one: one.name)
def test_drawn_rows_made_afresh_are_the_published_ones(investigation, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    table, about = investigation.table(), published.about(investigation.name)
    machines = {part: published.batch_of(about, part)["machine"] for part in table.part.unique()}
    table = table[table.part.map(investigation.is_current)]
    made_here = table.part.map(lambda part: machines[part] == fingerprint()).to_numpy(bool)
    table = table[made_here | is_repeatable(investigation, table)]
    if table.empty:
        pytest.skip(f"rows of {investigation.name} are of earlier epochs, or of other machines")
    order = np.random.default_rng(0).permutation(len(table))[:DRAWN]
    for row in table.iloc[order].to_dict("records"):
        one = Condition(*(row.pop(name) for name in Condition._fields))
        made = investigation.make(one, investigation.conditions(one.part)[one])
        row = {name: value for name, value in row.items() if name not in PRICE}
        again = {name: rounded(made[name], investigation.digits) for name in row}
        pd.testing.assert_series_equal(pd.Series(again), pd.Series(row), check_dtype=False)
