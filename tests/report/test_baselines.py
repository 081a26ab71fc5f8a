"""Whether C1 depends on how the baseline DES is read."""

from dataclasses import replace

import pandas as pd
import pytest

from nmpcrl.analysis.statistics import paired_p
from nmpcrl.claims import evidence
from nmpcrl.claims.published import Evidence
from nmpcrl.claims.thresholds import divergence
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
    told = baselines(found.runs, found.paths)
    (row,) = told.to_dict("records")
    assert (str(row["diverged"]), str(row["main"])) == ("0 of 16", "16 of 16")
    assert row["changes"]
    assert (row["gained"], row["lost"], row["p_diverged"]) == (0, 16, 2 / 2**16)
    assert "another outcome with: `late` (not reproduced)." in conclusion(told)
    assert "| `late`: the network is one fit late" in table(told)


def test_a_reading_that_diverges_alike_changes_nothing(study):
    found = study("lagged", stopped)
    told = baselines(found.runs, found.paths)
    assert told.p_diverged.item() == 1
    assert "another outcome with: none." in conclusion(told)


def test_how_often_des_diverges_is_tested_on_its_own_and_not_by_the_p_of_the_claim():
    known = evidence.gather("published", variants=True)
    told, runs = baselines(known.runs, known.paths).loc["averaged"], known.runs
    names = ["layout", "decay", "seed"]
    other, main = (
        divergence(one).set_axis(one.set_index(names).index).astype(bool)
        for one in (runs[(runs.variant == name) & (runs.learner == "DES")]
                    for name in ("averaged", "main"))
    )  # fmt: skip
    main = main[other.index]
    assert (told.diverged, told.main) == ((other.sum(), 60), (main.sum(), 60))
    assert (told.gained, told.lost) == ((other & ~main).sum(), (main & ~other).sum())
    assert told.p_diverged == paired_p(told.gained, told.lost)


def test_what_was_not_run_is_not_told(made_up):
    found = made_up(stopped)
    told = baselines(found.runs, found.paths)
    assert told.empty
    assert conclusion(told) == "No other reading of the baseline was run."
