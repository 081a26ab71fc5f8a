"""What the one-page summary says of numbers that a test makes up."""

import re
from dataclasses import replace

import pandas as pd
import pytest

from nmpcrl.claims import published
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.published import Published
from nmpcrl.claims.reproduce import Agreement
from nmpcrl.claims.robustness import COLUMNS
from nmpcrl.claims.verdict import (
    NOT,
    PARTLY,
    REPRODUCED,
    UNDECIDABLE,
    Halves,
    Verdict,
)
from nmpcrl.report import text
from nmpcrl.study import Experiment
from nmpcrl.study.departures import DEPARTURES
from nmpcrl.study.design import VARIANTS

OWN = "for_reviewers.ipynb#reviewers-own"
ABOUT = {
    "runs": {"main": 1200, "controls": 60, "soft box": 40, "tanh": 20},
    "hours": 12.34,
    "versions": {"python": "3.11.9", "casadi": "3.8.2"},
    "machine": {
        "processor": "Abacus 9",
        "architecture": "x86_64",
        "cores": 2,
        "system": "Linux",
    },
}


def verdict(claim: str, outcome: str, layouts: str = "", decays: str = "") -> Verdict:
    """One whose outcomes in layouts A, B, ... and per step, per episode are letters: y, p, n, o."""
    read = {"y": REPRODUCED, "p": PARTLY, "n": NOT, "o": UNDECIDABLE}
    return Verdict(
        claim,
        "It is so.",
        outcome,
        "elsewhere",
        by_layout={name: read[letter] for name, letter in zip("ABCDEF", layouts, strict=False)},
        by_decay={
            name: read[letter] for name, letter in zip(("step", "episode"), decays, strict=False)
        },
    )


def half(decay: str, against: int) -> Halves:
    """Nine pairs in one reading of the decay, in which one of two learners diverged."""
    return Halves(("DES", "RDES"), "diverged", decay, 9, (9 - against, against), against, 9)


def table(*rows: tuple[str, str, bool]) -> pd.DataFrame:
    """What `variant_changes` returns, as far as it matters here."""
    frame = pd.DataFrame(rows, columns=["variant", "claim", "changes"])
    return frame.reindex(columns=list(COLUMNS))


def test_the_effort_names_runs_hours_machine_and_versions():
    seeds = pd.DataFrame({"seed": range(1320)})
    runs = {Experiment(seed=s): None for s in seeds.seed}
    found = Published(runs, seeds, about={"batches": [ABOUT]})
    said = text.compute_effort(found)
    for part in ("1,320 runs of 300 episodes", "1,200 in", "60 with", "60 in 2 variants"):
        assert part in said
    for part in (
        "12.3 hours",
        "machine with 2 cores (Abacus 9, Linux; ",
        "python 3.11.9 and casadi 3.8.2",
    ):
        assert part in said
    assert found.parts["main"] == 1200  # the sentence takes nothing out


def test_where_nothing_is_published_the_page_says_so_and_what_to_do():
    for said in (text.compute_effort(Published()), text.answer(())):
        assert "Nothing is published" in said
        assert "`nmpcrl study --publish`" in said
    assert text.by_layout_and_decay(()) == text.verdicts_changed(table()) == ""
    assert text.depends_on((), table()) == {}
    assert text.open_gaps({}).startswith("Nothing was found")


def test_the_outcomes_are_counted_and_each_claim_is_named_once():
    judged = [verdict("C1", REPRODUCED), verdict("C2", NOT), verdict("C3", REPRODUCED)]
    said = text.answer(judged)
    assert said == (
        "Does it reproduce? **In part:** of the paper's three claims, two are reproduced (C1 and"
        " C3) and one is not reproduced (C2)."
    )
    assert UNDECIDABLE not in said


@pytest.mark.parametrize(
    ("outcomes", "head"),
    [
        ((REPRODUCED, REPRODUCED), "Yes"),
        ((REPRODUCED, UNDECIDABLE), "Yes"),
        ((REPRODUCED, NOT), "In part"),
        ((PARTLY, PARTLY), "In part"),
        ((NOT, NOT), "No"),
        ((NOT, UNDECIDABLE), "No"),
        ((UNDECIDABLE,), "Not decidable"),
    ],
)
def test_the_answer_is_what_the_decided_claims_say(outcomes, head):
    judged = [verdict(f"C{i}", one) for i, one in enumerate(outcomes, start=1)]
    assert f"**{head}:**" in text.answer(judged)


def test_the_legend_says_what_c7s_percentage_leaves_out_where_c7_is_shown(some_stopped):
    c7 = replace(verdict("C7", PARTLY), by_learner={"RDES": (2, 4)})
    said = text.legend([c7], some_stopped)
    assert said.endswith(
        " Without noise, 2 of 4 runs kept them, 2 of which had to be stopped in training."
    )
    assert "C7" not in text.legend([verdict("C1", PARTLY)], pd.DataFrame())


def test_the_commit_that_fixed_the_thresholds_is_named_with_its_date_and_how_to_see_it():
    first = {"hash": "a" * 40, "date": "2026-01-01 10:00"}
    then = {"hash": "b" * 40, "date": "2026-01-02 11:00"}
    said = text.fixed({"thresholds": first, "published": then})
    for part in ("`aaaaaaaaaa` (2026-01-01 10:00 UTC)", "`bbbbbbbbbb` (2026-01-02 11:00 UTC)"):
        assert part in said
    assert "`git show aaaaaaaaaa`" in said
    assert "cannot be said" in text.fixed({})


def test_a_page_says_for_which_claims_its_own_runs_agree():
    known = [verdict("C1", PARTLY), verdict("C2", NOT), verdict("C3", NOT)]
    assert text.agreement(known, known, "4 published").endswith(
        "(4 published) give the published outcome for 3 of 3 claims."
    )
    own = [verdict("C1", PARTLY), verdict("C2", REPRODUCED), verdict("C3", UNDECIDABLE)]
    assert text.agreement(own, known, "4 fresh").endswith(
        "give the published outcome for 1 of 3 claims, another for 1 (C2 reproduced)"
        " and none for 1 (too few runs: C3)."
    )


def test_claims_that_the_paper_takes_for_granted_are_counted_apart():
    said = text.answer([verdict("C1", PARTLY), verdict("C9", PARTLY), verdict("W9", NOT)])
    assert "of the paper's one claim and one that it takes for granted, two are" in said


@pytest.mark.parametrize(
    ("layouts", "decays", "disagreeing"),
    [
        ("yyyy", "yy", (False, False)),
        ("yyny", "yy", (True, False)),
        ("yypy", "yn", (True, True)),
        ("yyoy", "yo", (False, False)),  # what is not decided contradicts nothing
        ("oooo", "oo", (False, False)),
    ],
)
def test_layouts_and_readings_disagree_where_two_decided_verdicts_differ(
    layouts, decays, disagreeing
):
    judged = [verdict("C5", PARTLY, layouts, decays), verdict("C8", NOT)]
    by_layout, by_decay = re.findall(r": (\S+?)[;.]", text.by_layout_and_decay(judged))
    assert (by_layout == "C5", by_decay == "C5") == disagreeing
    depending = text.depends_on(judged, table())
    assert ("B" in depending, "C" in depending) == disagreeing


def test_variants_that_change_a_verdict_are_counted_once():
    rows = [("soft box", "C1", True), ("soft box", "C2", True), ("tanh", "C1", False)]
    said = text.verdicts_changed(table(*rows).assign(p=[0.3, 0.009, 0.001]))
    assert said.startswith("Of 2 variants, each with one thing changed, 1 change at least one")
    assert "1 of them with p < 0.01. 3 verdicts were compared" in said
    assert ", 0 of them" in text.verdicts_changed(table(*rows).assign(p=[0.3, 0.01, 0.001]))


def test_the_first_claim_of_the_published_study_depends_on_the_reading_of_the_decay():
    claims = [v for v in published.load().verdicts if v.claim == "C1"]
    assert text.depends_on(claims, table())["C"] == ("C1",)
    assert "It matters to C1 ([departure C]" in text.open_gaps(text.depends_on(claims, table()))


def test_a_claim_that_turns_round_with_the_reading_of_the_decay_depends_on_it():
    same = verdict("C1", PARTLY, "pp", "pp")
    claimed, other = half("step", 0), half("episode", 0)
    turned = replace(same, halves=(claimed, half("episode", 5)))
    assert text.depends_on([turned], table()) == {"C": ("C1",)}
    assert "learners of C1 differ as claimed in one" in text.by_layout_and_decay([turned])
    unsure = replace(same, halves=(half("step", 3), half("episode", 5)))
    for one in (same, unsure, replace(same, halves=(claimed, other))):
        assert text.depends_on([one], table()) == {}
        assert "differ as claimed" not in text.by_layout_and_decay([one])


def test_claims_of_our_own_are_confirmed_or_not_and_never_called_reproduced():
    judged = [
        replace(verdict(name, outcome), said=OWN_CLAIMS[name].words.get(outcome, ""))
        for name, outcome in (("B1", NOT), ("B2", PARTLY), ("B3", REPRODUCED), ("B4", UNDECIDABLE))
    ]
    assert text.outcomes(judged).splitlines() == [
        f"- [B1]({OWN}). It is so. *Not confirmed.*",
        f"- [B2]({OWN}). It is so. *Confirmed in part.*",
        f"- [B3]({OWN}). It is so. *Confirmed.*",
        f"- [B4]({OWN}). It is so. *Not decidable here.*",
    ]


def test_a_verdict_leads_to_what_it_rests_on_a_wider_one_to_that_of_the_papers_claim():
    first, wider = verdict("C1", NOT), verdict("W7", PARTLY)
    link = "[C1](for_reviewers.ipynb#reviewers-c1)"
    assert text.judged(first) == f"{link} (*It is so*): **not reproduced**."
    assert text.audits([first, wider]) == (
        f"What each rests on: {link} and [W7](for_reviewers.ipynb#reviewers-c7)."
    )


def test_a_claim_with_words_of_its_own_is_counted_apart():
    judged = [
        verdict("C2", NOT),
        replace(verdict("C8", NOT), said="the guarantee does not apply"),
        verdict("C9", PARTLY),
    ]
    assert text.answer(judged).endswith(
        "one is partly reproduced (C9), one is not reproduced (C2) and for one the guarantee does"
        " not apply (C8)."
    )


def test_a_departure_counts_every_variant_that_reads_it_otherwise():
    assert (VARIANTS["tanh"].departure, VARIANTS["four fits"].departure) == ("H", "H")
    assert VARIANTS["alpha x 3"].departure == ""
    judged = table(
        ("tanh", "C6", True),
        ("four fits", "C1", True),
        ("four fits", "C6", True),
        ("soft box", "C5", False),
        ("alpha x 3", "C9", True),  # the paper is clear about alpha
    )
    assert text.depends_on([verdict("C2", PARTLY, "yn", "yy")], judged) == {
        "B": ("C2",),
        "H": ("C1", "C6"),
    }


def test_a_question_quotes_the_gap_and_leads_to_its_entry():
    said = text.open_gaps({"B": ("C2",), "H": ("C1", "C6")})
    first, second = said.splitlines()
    assert first.startswith(f"- {DEPARTURES['B'].gap} ")
    assert first.endswith("matters to C2 ([departure B](departures.ipynb#departure-B)).")
    assert "C1 and C6 ([departure H](departures.ipynb#departure-H))." in second


@pytest.mark.parametrize(
    ("names", "said"),
    [((), "none"), (("a",), "a"), (("a", "b"), "a and b"), ((1, 2, 3), "1, 2 and 3")],
)
def test_names_are_listed_as_a_sentence_has_them(names, said):
    assert text.listed(names) == said


def test_runs_that_were_trained_again_are_counted_and_judged_beside_the_published_ones():
    there = (verdict("C1", PARTLY), verdict("C2", NOT), verdict("C3", NOT))
    same = text.repeated(Agreement(6, 4, 1, there, there))
    assert "Of 6 published runs" in same
    assert "4 have the published numbers in every digit, and 1 more to six digits" in same
    assert same.endswith("layouts and readings for 3 of 3 claims.")
    here = (verdict("C1", PARTLY), verdict("C2", REPRODUCED), verdict("C3", UNDECIDABLE))
    assert text.repeated(Agreement(6, 4, 1, here, there)).endswith(
        "for 1 of 3 claims, another for 1 (C2: reproduced here, not reproduced there)"
        " and none for 1 (too few runs: C3)."
    )
    assert text.repeated(Agreement(0, 0, 0, (), ())) == "No published run was trained again here."
