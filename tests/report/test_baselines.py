"""Whether C1 depends on how the baseline DES is read."""

from dataclasses import replace

import pandas as pd
import pytest

from nmpcrl.claims.evidence import Evidence, paths
from nmpcrl.report.baselines import READINGS, baselines, conclusion, table


def stopped(experiment) -> dict:
    """DES is stopped wherever it learns."""
    return {"reached": 40} if experiment.learner == "DES" else {}


@pytest.fixture
def study(made_up):
    """The main table, in which DES diverges, and a reading of DES with which it does not."""

    def with_reading(name: str, unlike=lambda e: {}) -> Evidence:
        main, other = made_up(stopped), made_up(unlike)
        des = other.runs[other.runs.learner == "DES"].assign(variant=name)
        runs = pd.concat([main.runs, des], ignore_index=True)
        return replace(main, runs=runs)

    return with_reading


def test_the_four_readings_are_those_of_departure_i():
    assert READINGS == ("lagged", "averaged", "greedy", "late")


def test_a_reading_with_which_des_does_not_diverge_changes_c1(study):
    found = study("late")
    told = baselines(found.runs, paths(found))
    (row,) = told.to_dict("records")
    assert (str(row["diverged"]), str(row["main"])) == ("0 of 16", "16 of 16")
    assert row["changes"]
    assert "With `late` (not reproduced, p = " in conclusion(told)
    assert "by more than chance explains with `late` (p = " in conclusion(told)
    assert "| `late`: the network is one fit late" in table(told)


def test_a_reading_that_diverges_alike_changes_nothing(study):
    found = study("lagged", stopped)
    told = baselines(found.runs, paths(found))
    assert "to the same with every reading of the baseline as in the main table" in conclusion(told)
    assert "No reading changes how often DES diverges by more" in conclusion(told)


def test_what_was_not_run_is_not_told(made_up):
    found = made_up(stopped)
    told = baselines(found.runs, paths(found))
    assert told.empty
    assert conclusion(told) == "No other reading of the baseline was run."
