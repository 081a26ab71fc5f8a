"""Sentences about the halves of a claim: of counts that a test makes up."""

from dataclasses import replace

import pytest

from nmpcrl.claims.verdict import PARTLY, Halves, Verdict
from nmpcrl.report import halves

LEARNERS = ("DES", "RDES")
CLAIMED = Halves(LEARNERS, "diverged", "step", 20, (20, 10), 0, 10)
VERDICT = Verdict("C1", "It is so.", PARTLY, "elsewhere")


def test_how_often_each_went_wrong_is_one_sentence_a_way_of_going_wrong():
    stopped = Halves(LEARNERS, "had to be stopped", "step", 20, (3, 1), 0, 2)
    again = replace(CLAIMED, decay="episode", counts=(5, 6))
    both = replace(VERDICT, halves=(CLAIMED, again, stopped))
    assert halves.own(both) == (
        "Diverged: with noise that decays per step in 20 of 20 runs of DES and 10 of RDES (pairs"
        " that differ: 10, as claimed: 10; McNemar's p = 0.002); with noise that decays per"
        " episode in 5 of 20 runs of DES and 6 of RDES (pairs that differ: 10, as claimed: 10;"
        " McNemar's p = 0.002)."
    )
    assert halves.apart(both) == (
        f"{halves.own(both)} Had to be stopped: with noise that decays per step in 3 of 20 runs of"
        " DES and 1 of RDES (pairs that differ: 2, as claimed: 2; McNemar's p = 0.5)."
    )
    assert halves.own(VERDICT) == ""
    assert halves.apart(VERDICT) == ""


@pytest.mark.parametrize(
    ("claim", "said"), [("C7", "2 of RDES had"), ("W7", "1 of DES and 2 of RDES had")]
)
def test_runs_that_were_stopped_are_counted_beside_the_constraints(claim, said, some_stopped):
    one = replace(VERDICT, claim=claim, by_learner={"RDES": (1, 2)})
    assert "1 of 2 runs of RDES" in (items := halves.items([one], some_stopped))
    assert f"\n  - Of those that kept them, {said}" in items
