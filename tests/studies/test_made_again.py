"""Drawn rows of each published investigation, made afresh, are the published ones.

On the machine that made them, all are, to the last published digit. Elsewhere learning may magnify
a last bit: most are equal (of 21 further rows of `worlds`, 15), and rows of networks are left out.
A part is asked once its published rows are of the present epochs.
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
CHAOTIC = {"agents", "interventions", "other_problems"}  # other numbers on other machines


def is_repeatable(investigation, table):
    """Whether each row, made elsewhere, may have the same numbers here."""
    if investigation.name == "population":  # a network's products round otherwise
        return np.array([not LEARNERS[one.learner].network for one in experiments(table)], bool)
    return np.full(len(table), investigation.name not in CHAOTIC)


@pytest.mark.weekly
@pytest.mark.parametrize("investigation", INVESTIGATIONS, ids=lambda one: one.name)
def test_drawn_rows_made_afresh_are_the_published_ones(investigation, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    table, about = investigation.table(), published.about(investigation.name)
    machines = {part: published.batch_of(about, part)["machine"] for part in table.part.unique()}
    table = table[table.part.map(investigation.is_current)]
    here = table.part.map(lambda part: machines[part] == fingerprint()).to_numpy(bool)
    table = table.assign(here=here)[here | is_repeatable(investigation, table)]
    if table.empty:
        pytest.skip(f"rows of {investigation.name} are of earlier epochs, or of other machines")
    order, elsewhere = np.random.default_rng(0).permutation(len(table))[:DRAWN], list[bool]()
    for row in table.iloc[order].to_dict("records"):
        is_here = row.pop("here")
        one = Condition(*(row.pop(name) for name in Condition._fields))
        made = investigation.make(one, investigation.conditions(one.part)[one])
        row = {name: value for name, value in row.items() if name not in PRICE}
        again = {name: rounded(made[name], investigation.digits) for name in row}
        same = pd.Series(again, dtype=object).equals(pd.Series(row, dtype=object))
        assert same or not is_here, (one, again, row)
        elsewhere += [] if is_here else [same]
    assert 2 * sum(elsewhere) >= len(elsewhere)
