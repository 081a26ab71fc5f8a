"""A verdict contradicts a published one if both are decided, they differ, and not by chance."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.rows import row, table
from nmpcrl.claims import agreement
from nmpcrl.claims.agreement import contradictions, of_runs, of_times
from nmpcrl.claims.paper_claims import judge_times
from nmpcrl.claims.published import Published
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome, Verdict
from nmpcrl.study import design
from nmpcrl.study.storage.machine import fingerprint


def verdict(outcome: Outcome, interval: tuple[float, float] | None = None) -> Verdict:
    share = None if interval is None else sum(interval) / 2
    return Verdict("C1", "It works.", outcome, "", "", share, interval)


@pytest.mark.parametrize(
    ("here", "there", "contradict"),
    [
        (verdict(REPRODUCED, (0.8, 1.0)), verdict(NOT, (0.0, 0.2)), True),
        (verdict(REPRODUCED, (0.8, 1.0)), verdict(PARTLY, (0.3, 0.7)), True),
        (verdict(REPRODUCED, (0.8, 1.0)), verdict(PARTLY, (0.3, 0.81)), False),
        (verdict(PARTLY, (0.1, 0.2)), verdict(PARTLY, (0.6, 0.7)), False),
        (verdict(UNDECIDABLE, (0.9, 1.0)), verdict(NOT, (0.0, 0.2)), False),
        (verdict(REPRODUCED, (0.8, 1.0)), verdict(UNDECIDABLE, (0.0, 0.2)), False),
        (verdict(REPRODUCED), verdict(NOT), True),
        (verdict(NOT), verdict(NOT), False),
        (verdict(UNDECIDABLE), verdict(NOT), False),
    ],
    ids=[
        "for and against",
        "apart",
        "overlapping",
        "same outcome",
        "open here",
        "open there",
        "no sample",
        "no sample, same",
        "no sample, open",
    ],
)
def test_two_verdicts_contradict_each_other_beyond_chance_alone(here, there, contradict):
    assert bool(contradictions([here], [there])) == contradict
    assert bool(contradictions([there], [here])) == contradict


def test_the_sentence_says_both_outcomes_and_what_they_rest_on():
    (told,) = contradictions([verdict(REPRODUCED, (0.8, 1.0))], [verdict(NOT, (0.0, 0.2))])
    assert told == (
        "C1 is reproduced (90% [80%, 100%]) here, and not reproduced (10% [0%, 20%]) as published"
    )


def test_a_claim_on_which_nothing_is_published_contradicts_nothing():
    assert contradictions([replace(verdict(REPRODUCED), claim="C9")], [verdict(NOT)]) == ()


def timings(ratio: float, waited: float = 0.0) -> pd.DataFrame:
    rows = [
        {"solver": "ipopt", "learner": name, "ratio": value, "waited": waited}
        | {"ratio_low": value - 0.01, "ratio_high": value + 0.01}
        for name, value in {"ES": 1.0, "RDES": ratio, "GES": 1.0}.items()
    ]
    return pd.DataFrame(rows)


def timed(ratio: float) -> Published:
    """What is published of this machine."""
    taken = timings(ratio)
    about = {"timings": {"machine": fingerprint()}}
    return Published(verdicts=judge_times(taken), timings=taken, about=about)


def test_times_contradict_where_both_are_decided_and_apart():
    (told,) = of_times(timings(0.5), timed(0.65))
    assert told.startswith("C3 is reproduced (0.50 [0.49, 0.51]) here, and partly reproduced (0.65")
    assert of_times(timings(0.7), timed(0.65)) == ()


def test_times_of_a_busy_machine_never_contradict():
    assert of_times(timings(0.5, waited=0.9), timed(0.65)) == ()
    assert of_times(timings(0.6, waited=0.3), timed(0.65)) == ()  # it reaches across a border


def test_times_of_another_machine_contradict_nothing():
    another = {"machine": fingerprint() | {"processor": "another"}}
    known = replace(timed(0.65), about={"machine": fingerprint(), "timings": another})
    assert of_times(timings(0.5), known) == ()


def published_of(found) -> Published:
    """Evidence as if it had been published."""
    rows = dict(zip(found.summaries, table(found.summaries).to_dict("records"), strict=True))
    return Published(
        summaries=found.summaries, variants=dict.fromkeys(rows, design.MAIN_TABLE), rows=rows
    )


def diverges(experiment):
    """The claim C1: DES is stopped and RDES is not."""
    return {"reached": 40, "training": np.inf} if experiment.learner == "DES" else {}


def test_runs_contradict_published_ones_of_the_same_layouts(made_up):
    here, there = made_up(diverges), made_up()
    told = of_runs(here.summaries, published_of(there))
    assert [one[:2] for one in told] == ["C1", "W9"]
    assert "C1 is reproduced (100%" in told[0]
    assert "not reproduced (0%" in told[0]


@pytest.mark.slow
def test_runs_do_not_contradict_themselves_nor_a_part_the_whole(made_up):
    whole = made_up(lambda e: diverges(e) if e.layout == "A" else {})
    assert of_runs(whole.summaries, published_of(whole)) == ()
    part = {e: one for e, one in whole.summaries.items() if e.layout == "A"}
    assert of_runs(part, published_of(whole)) == ()


def test_short_runs_and_runs_of_variants_contradict_nothing(made_up):
    known = published_of(made_up())
    short = made_up(diverges, episodes=50)
    assert of_runs(short.summaries, known) == ()
    varied = {replace(e, horizon=5): one for e, one in made_up(diverges).summaries.items()}
    assert of_runs(varied, known) == ()


def test_layouts_that_are_not_published_contradict_nothing(made_up):
    elsewhere = made_up(diverges, layouts=("B",))
    assert of_runs(elsewhere.summaries, published_of(made_up())) == ()


def test_every_decidable_claim_of_the_runs_is_held_against_what_is_published(made_up, monkeypatch):
    asked = []

    def keep(found, known):
        asked.extend(one.claim for one in found if one.outcome != UNDECIDABLE)
        return ()

    monkeypatch.setattr(agreement, "contradictions", keep)
    of_runs(made_up().summaries, published_of(made_up()))
    assert asked == ["C1", "C2", "C5", "C6", "C7", "C9", "W7", "W9", "B1"]


def test_published_runs_that_are_trained_again_are_counted_by_how_equal_they_are(made_up):
    found = made_up(layouts=("A",), seeds=(0, 1))
    rows = {e: row(one) for e, one in found.summaries.items()}
    first, second, third, *_ = (e for e in rows if e.learner != "frozen")
    rows[first] = rows[first] | {"final_cost": rows[first]["final_cost"] * (1 + 1e-9)}
    rows[second] = rows[second] | {"theta_0": rows[second]["theta_0"] + 1}
    parts = dict.fromkeys(rows, "main") | {third: "N = 5"}
    told = agreement.repeated(found.summaries, Published(found.summaries, parts, rows))
    assert (told.runs, told.equal, told.close) == (len(rows) - 1, len(rows) - 3, 1)
    assert [one.claim for one in told.here] == [one.claim for one in told.there]


def test_without_a_published_run_nothing_is_repeated():
    told = agreement.repeated({}, Published())
    assert (told.runs, told.here, told.there) == (0, (), ())
