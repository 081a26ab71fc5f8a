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


def saving(**changed) -> Saving:
    """Beside one solver, or beside several."""
    parts = {"solve": 1.0, "warm": 1.0, "network": 0.2, "rest": 0.05, "rest_rdes": 0.05} | changed
    count = np.size(parts["solve"])
    return Saving(**{name: np.broadcast_to(one, count) for name, one in parts.items()})


def test_there_is_a_break_even_only_where_the_network_costs_something():
    assert timing.break_even(saving()).endswith("more than about 0.2 ms.")
    assert "however fast" in timing.break_even(saving(network=0.0, rest_rdes=0.01))
    assert "however slow" in timing.break_even(saving(warm=0.4))
    two = saving(solve=[0.05, 1.0], network=[0.1, 0.2])
    assert timing.break_even(two).endswith("about 0.1 ms (it lies between 0.1 and 0.2 ms).")


def test_slow_solves_give_one_half_only_where_all_take_alike():
    said = timing.slow_solves(saving(warm=0.8), 830.0)
    assert said.startswith("With solves of 0.83 s, the paper's, a step of RDES would take 0.63 of")
    assert said.endswith("and 0.50 if all solves took alike (C3).")


def test_the_coverage_is_that_of_the_worst_and_of_all():
    rows = [("ES", 10, 10), ("GES", 10, 9), ("RDES", 10, 10)]
    said = timing.coverage(pd.DataFrame(rows, columns=["learner", "repetitions", "inside"]))
    assert "repeated 10 times" in said
    assert "at least 9 of 10 contain" in said
    assert "95% over all" in said


def test_a_ratio_has_its_interval_and_carries_what_it_is_of(measured):
    table = summary.learners(measured)
    row = table.set_index(["solver", "learner"]).loc["ipopt", "RDES"]
    shown = str(timing.to_es(table, "ipopt", "RDES"))
    assert f">{row.ratio:.2f} [{row.ratio_low:.2f}, {row.ratio_high:.2f}]</data>" in shown
    assert 'title="step of RDES in steps of ES, with ipopt: the published measurement"' in shown
    assert f">{row.ratio:.3f}</data>" in f"{timing.to_es(table, 'ipopt', 'RDES'):.3f}"
    with pytest.raises(KeyError):
        timing.to_es(table, "scipy", "RDES")


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
