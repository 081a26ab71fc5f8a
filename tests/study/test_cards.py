"""What pages show of verdicts, assumptions and departures."""

import re

import pytest

from nmpcrl.study import Study, cards, main_study
from nmpcrl.study.audit import Assumption
from nmpcrl.study.claims import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Verdict
from nmpcrl.study.paper import DEPARTURES

OUTCOMES = (REPRODUCED, PARTLY, NOT, UNDECIDABLE)


def verdict(outcome: str, statement: str = "a < b & c.") -> Verdict:
    return Verdict("C1", statement, outcome, "4 of 4 runs.", "Elsewhere (departure G).")


@pytest.mark.parametrize("outcome", OUTCOMES)
def test_a_verdict_has_a_badge_of_its_own_and_says_it_in_words(outcome):
    table = cards.verdict_table([verdict(outcome)], "All of it.")
    assert f'<span class="{cards.BADGES[outcome]}">{outcome}</span>' in table
    assert len(set(cards.BADGES.values())) == len(OUTCOMES)


def test_what_a_claim_says_cannot_break_the_page():
    assert "a &lt; b &amp; c." in cards.verdict_table([verdict(NOT)], "<caption>")
    assert "&lt;caption&gt;" in cards.verdict_table([], "<caption>")


def test_an_assumption_says_in_words_whether_it_holds():
    table = cards.assumption_table(
        [Assumption("x", "y", holds=True), Assumption("x", "y", holds=False)], "Audit."
    )
    assert re.findall(r">(holds|does not hold)<", table) == ["holds", "does not hold"]


def test_the_evidence_links_to_departures():
    assert "departure {ref}`G <departure-G>`" in cards.evidence([verdict(NOT)])


def test_the_scope_names_layout_seeds_readings_and_length():
    study = Study(dict.fromkeys(main_study(episodes=7, seeds=(3, 5)), None))
    assert cards.scope(study) == (
        "Judged from 20 runs of 7 episodes: layout A, seeds 3 and 5, exploration that decays per"
        " step and per episode."
    )


def test_the_scope_of_one_seed_is_in_the_singular():
    study = Study(dict.fromkeys(main_study(episodes=7, seeds=(3,)), None))
    assert "layout A, seed 3, exploration" in cards.scope(study)


@pytest.mark.parametrize("letter", DEPARTURES)
def test_a_departure_shows_all_of_its_entry(letter):
    shown, entry = cards.departure(letter), DEPARTURES[letter]
    assert all(part in shown for part in (entry.gap, entry.reading, entry.why))
    assert ("To run another reading" in shown) == bool(entry.variant)
