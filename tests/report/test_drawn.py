"""What a page says of the drawn layouts."""

import re

import pandas as pd

from nmpcrl.report.drawn import in_short, share_table, whole_or_nearest
from nmpcrl.studies.difficulty import OPEN
from nmpcrl.studies.population import PICTURE, Drawn, shares
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


def test_in_short_counts_as_improved_what_saves_a_per_cent_and_asks_of_gaps_where_there_is_one(
    made_up,
):
    names = ["J001", "J002", "J003"]
    layouts = tuple(JUDGE[name] for name in names)
    found = made_up(layouts=layouts, seeds=(0,))
    runs = found.runs.assign(part="judge", theta_8=0.2)
    costs = {
        Experiment(layout=JUDGE[name]).layout: cost
        for name, cost in zip(names, (0.9, 0.995, 1.1), strict=True)
    }
    runs["final_cost"] = runs.initial_cost * [costs[layout] for layout in runs.layout]
    closes = pd.DataFrame({"closes": {"J001": 0.3, "J002": 0.1, "J003": OPEN}})
    said = re.sub(r"<[^>]+>", "", in_short(Drawn(runs, {}, closes)))
    said, each = " ".join(said.split()), len(runs[runs.learner == "ES"]) // 3
    assert "Of 3 drawn layouts ES improves 1." in said
    assert "it does not improve 1 of 1 layouts" in said
    assert "and 1 of 2 others" in said
    assert f"{each} of {each} improve where it stayed open, and 0 of {each} where" in said


def test_the_nearest_is_named_with_what_is_changed_and_its_shares_of_yes():
    shares = {"C1": 1.0, "C2": 0.0, "C5": 0.8, "C9": 1.0, "whole": 2}
    tried = pd.DataFrame([{"layout": "D", "decay": "step", "setting": "lagged"} | shares])
    assert whole_or_nearest(tried) == (
        "Nearest comes layout D with the decay per step and a copy of the network, refreshed once"
        " an episode, predicts, where yes are C1 100%, C2 0%, C5 80% and C9 100%."
    )


def test_every_place_is_named_where_the_whole_picture_appears():
    drawn = Experiment(layout=JUDGE["J001"]).layout
    whole = dict.fromkeys(PICTURE, 1.0) | {"layout": drawn, "setting": "main", "whole": 4}
    known = [whole | {"decay": "step"}, whole | {"decay": "episode"}, whole | {"whole": 3}]
    assert whole_or_nearest(pd.DataFrame(known)) == (
        "It appears in layout J001, with obstacles at (-0.9, 0.7), (-0.5, 4.8), (4.5, 4.9),"
        " (5, 1.7), with the decay per step and per episode."
    )
