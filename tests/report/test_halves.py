"""Sentences about the halves of a claim: of counts that a test makes up."""

from dataclasses import replace

import pytest

from nmpcrl.claims.verdict import NOT, PARTLY, WHOLE, Halves, Verdict
from nmpcrl.report import halves

LEARNERS = ("DES", "RDES")
CLAIMED = Halves(LEARNERS, "diverged", "step", (WHOLE,), 20, (20, 10), 0, 10)
REVERSE = Halves(LEARNERS, "diverged", "episode", ("B", "C"), 11, (0, 11), 11, 11)
VERDICT = Verdict("C1", "It is so.", PARTLY, "evidence", "elsewhere")


def test_how_often_each_went_wrong_is_one_sentence_a_way_of_going_wrong():
    stopped = Halves(LEARNERS, "had to be stopped", "step", (WHOLE,), 20, (3, 1), 0, 2)
    again = replace(CLAIMED, decay="episode", counts=(5, 6))
    assert halves.apart(replace(VERDICT, halves=(CLAIMED, again, stopped))) == (
        "Diverged: with noise that decays per step in 20 of 20 runs of DES and 10 of RDES,"
        " with noise that decays per episode in 5 of 20 runs of DES and 6 of RDES."
        " Had to be stopped: with noise that decays per step in 3 of 20 runs of DES and 1 of RDES."
    )
    assert halves.apart(replace(VERDICT, each="Each.")) == "Each."
    assert halves.apart(VERDICT) == ""


def test_where_two_learners_clearly_differ_is_said_with_counts_and_interval():
    found = replace(VERDICT, as_claimed=(CLAIMED,), reverse=(REVERSE,))
    assert halves.clear(found) == (
        "With noise that decays per step, as claimed: DES diverged in 20 of 20 runs and RDES in"
        " 10 (10 of 10 pairs that differ: 100% [72%, 100%]).",
        "With noise that decays per episode, in layouts B and C, the reverse was seen: RDES"
        " diverged in 11 of 11 runs and DES in 0 (11 of 11 pairs that differ: 100% [74%, 100%]).",
    )
    one = replace(REVERSE, layouts=("B",))
    assert ", in layout B, the" in "".join(halves.clear(replace(VERDICT, reverse=(one,))))


def test_the_parts_of_a_claim_are_listed_with_what_is_clear(some_stopped):
    both = replace(
        VERDICT, claim="C2", halves=(CLAIMED,), as_claimed=(CLAIMED,), reverse=(REVERSE,)
    )
    head, *beside = halves.items([VERDICT, both], some_stopped).splitlines()
    assert head == f"- **C2.** {halves.apart(both)}"
    assert beside == [f"  - {one}" for one in halves.clear(both)]


@pytest.mark.parametrize(
    ("claim", "said"), [("C7", "2 of RDES had"), ("W7", "1 of DES and 2 of RDES had")]
)
def test_runs_that_were_stopped_are_counted_beside_the_constraints(claim, said, some_stopped):
    one = replace(VERDICT, claim=claim, each="Each.")
    assert halves.items([one], some_stopped).startswith(
        f"- **{claim}.** Each.\n  - Of those that kept them, {said}"
    )


def test_where_two_learners_clearly_differ_is_said_with_the_claim_and_the_readings():
    twice = (CLAIMED, replace(CLAIMED, wrong="had to be stopped"))
    judged = [
        VERDICT,
        replace(VERDICT, claim="C2", outcome=NOT, reverse=(REVERSE,)),
        replace(VERDICT, claim="C3", as_claimed=twice, reverse=(REVERSE,)),
    ]
    assert halves.differences(judged) == (
        "Where two learners of a claim clearly differ: C2 (the reverse with noise that decays per"
        " episode) and C3 (as claimed with noise that decays per step, the reverse with noise that"
        " decays per episode)."
    )
    assert halves.differences(judged[:1]) == "Nowhere do two learners of a claim clearly differ."
