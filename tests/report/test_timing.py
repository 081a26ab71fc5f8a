"""Sentences on times, for measurements of every kind."""

from copy import deepcopy

import numpy as np
import pandas as pd
import pytest

from nmpcrl.bench import summary
from nmpcrl.bench.summary import Saving
from nmpcrl.bench.targets import Target
from nmpcrl.report import timing


def shares(**worse):
    """A table of two solvers, in which no solve failed."""
    table = pd.DataFrame({"worse": worse, "failed": 0.0}, index=["riccati", "ipopt"]).fillna(0.0)
    return table.rename_axis("solver")


def test_an_idle_machine_is_not_said_to_be_busy():
    assert "no other program" in timing.used_by_others(0.0)
    assert "up to 37% of the cores" in timing.used_by_others(0.37)


def test_solvers_that_lose_no_problem_are_not_compared():
    assert "%" not in timing.lost_problems(shares())
    assert "0.0% for riccati and at most 2.5%" in timing.lost_problems(shares(ipopt=0.025))
    assert "(ipopt)" in timing.lost_problems(shares(riccati=0.5))


def test_mpcrl_has_no_time_where_it_is_not_installed(measured):
    assert "times as long as a step of ES" in timing.beside_mpcrl(measured)
    without = deepcopy(measured)
    without["mpcrl"] = {"learner": [], "seconds": []}
    assert "nan" not in timing.beside_mpcrl(without)
    assert "not installed" in timing.beside_mpcrl(without)


def test_there_is_a_break_even_only_where_the_network_costs_something():
    assert timing.break_even(Saving(0.2, 0.05, 0.05)).endswith("more than 0.20 ms.")
    assert "however fast" in timing.break_even(Saving(0.0, 0.05, 0.01))


def test_a_ratio_has_its_interval_or_says_why_not(measured):
    table = summary.learners(measured).set_index(["solver", "learner"])
    row = table.loc["ipopt", "RDES"]
    shown = timing.rdes_to_es(measured, "ipopt")
    assert np.isfinite(row.ratio_low)
    assert shown == f"{row.ratio:.2f} [{row.ratio_low:.2f}, {row.ratio_high:.2f}]"
    few = deepcopy(measured)
    few["learners"]["ratio_low"] = [None] * len(table)
    assert "too few steps" in timing.rdes_to_es(few, "ipopt")
    with pytest.raises(KeyError):
        timing.rdes_to_es(measured, "scipy")


@pytest.mark.parametrize(
    ("ratio", "end"),
    [
        (0.63, "0.63, which is higher for the reasons below."),
        (0.50, "0.50, which is lower for the reasons below."),
        (0.555, "0.56, so they agree."),
    ],
)
def test_the_models_ratio_stands_beside_the_one_that_was_measured(ratio, end):
    measured = pd.DataFrame({"solve": [0.1, 2.0], "ratio": [9.0, ratio]}, ["fatrop", "ipopt"])
    said = timing.model_beside_measured(Saving(0.2, 0.0, 0.0), measured, 0.55)
    assert said == (
        "By the model, the ratio is below 0.55 where a solve takes more than 2.0 ms. With ipopt,"
        f" whose solves in RDES take 2.00 ms, the model gives 0.55 and the measurement {end}"
    )


@pytest.mark.parametrize(
    ("outcomes", "sentence"),
    [
        ([True, True], "All 2 targets are reached."),
        ([True, True, False], "Of 3 targets, 2 are reached and 1 missed."),
        ([True, True, False, None], "Of 4 targets, 2 are reached, 1 missed and 1 not measured."),
    ],
)
def test_targets_are_counted_without_what_there_is_none_of(outcomes, sentence):
    assert timing.reached([Target("", "", "", one) for one in outcomes]) == sentence
