"""What a page says of the drawn layouts."""

import pandas as pd

from nmpcrl.report.drawn import at_the_gap, improve_by_gap, share_table
from nmpcrl.studies.difficulty import OPEN
from nmpcrl.studies.population import Drawn, shares
from nmpcrl.study.drawn import JUDGE
from nmpcrl.study.experiment import Experiment

HELD = ["claim", "layout", "yes", "of", "holds", "weaker"]


def test_a_row_has_count_interval_outcome_and_what_was_expected():
    rows = [("ES improves", f"J{i:03}", 1, 2, i < 38, i < 38) for i in range(40)]
    rows += [("C7", f"J{i:03}", 0, 2, False, i < 39) for i in range(40)]
    table = share_table(shares(pd.DataFrame(rows, columns=HELD)))
    assert "0 of 40<br>0% [0%, 9%]<br>weaker question: 39 of 40" in table
    assert '<span class="verdict-partly">partly reproduced</span>' in table
    assert '<th scope="row"' in table
    assert "ES improves" in table
    assert "38 of 40<br>95% [83%, 99%]" in table
    assert '<span class="verdict-reproduced">reproduced</span>' in table
    assert "85% to 97%" in table


def test_a_formula_of_a_claim_is_typeset_in_its_row():
    rows = pd.DataFrame([("C9", "J000", 1, 2, True, True)], columns=HELD)
    table = share_table(shares(rows))
    assert r'beat <span class="math">\(\theta_\mathrm{init}\)</span>' in table
    assert "$" not in table


def test_runs_are_split_by_whether_theta_c_has_closed_a_gap_where_there_is_one(made_up):
    names = ["J001", "J002", "J003"]
    found = made_up(layouts=tuple(JUDGE[name] for name in names), seeds=(0,))
    runs = found.runs.assign(part="judge", theta_8=0.2, distance=0.0)
    costs = {
        Experiment(layout=JUDGE[name]).layout: cost
        for name, cost in zip(names, (0.9, 0.995, 1.1), strict=True)
    }
    runs["final_cost"] = runs.initial_cost * [costs[layout] for layout in runs.layout]
    closes = pd.DataFrame({"closes": {"J001": 0.3, "J002": 0.1, "J003": OPEN}})
    each = len(runs[runs.learner == "ES"]) // 3
    counts = improve_by_gap(at_the_gap(Drawn(runs, {}, closes)))
    assert counts == {"open": (each, each), "closed": (0, each)}
