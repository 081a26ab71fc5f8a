"""The finding in words: two sentences, four numbers with links, and what to use."""

import re

import pytest

from nmpcrl.claims.finding import Finding
from nmpcrl.report import finding, text

FOUND = Finding(
    arrived_open=(11, 12),
    arrived_closed=(1, 5),
    open_in=("A", "B"),
    closed_in=("E",),
    learned=0.034,
    by_hand=(2, 7),
    better=(1, 2),
    saved_by_hand=0.21,
    lost_by_hand=(0.3, 0.9),
    saved_there=0.13,
    stopped=(6, 9),
    stopped_early=4,
    stopped_per_step=(3, 9),
    early_per_step=1,
    above={"ES": (1, 17), "GES": (1, 17), "TDC": (7, 17)},
    worse={"ES": (1, 17), "GES": (1, 17), "TDC": (5, 17)},
    not_there={"ES": (3, 17), "GES": (4, 17), "TDC": (2, 17)},
    seconds=8.2,
    hours=3.14,
)


def plain(markdown: str) -> str:
    return " ".join(re.sub(r"<[^>]+>", "", markdown).split())


def test_the_finding_says_both_readings_of_the_decay_and_both_kinds_of_layouts():
    said = plain(finding.sentences(FOUND))
    assert "saves 21% in the 2 of 7 layouts" in said
    assert "it costs 30% to 90% more" in said
    assert "in 4 of 9 runs if noise decays per episode, and in 1 of 9 if" in said


def test_each_of_four_numbers_has_a_line_and_a_link():
    items = finding.numbers(FOUND).removeprefix("- ").split("\n- ")
    begins = ("11 of 12", "1 of 5", "2 of 7", "6 of 9")
    for item, number in zip(items, begins, strict=True):
        assert plain(item).startswith(f"**{number}**")
        assert len(re.findall(r"\]\([\w.]+#[\w-]+\)", item)) == 1
    assert "4 of them within 20 episodes" in plain(items[-1])


def test_what_to_use_says_whose_runs_went_astray_and_what_a_run_costs():
    said = plain(finding.use(FOUND))
    assert (
        "2 of 17 of its runs did not end at the target, against 3 of 17 of ES and 4 of 17" in said
    )
    assert "7 of 17 of its runs end above" in said
    assert "5 of 17 by more than 1%" in said
    assert "moves for 3.1 hours; simulated, 8 seconds of one core" in said


@pytest.mark.parametrize("say", [finding.sentences, finding.numbers, finding.use])
def test_without_a_finding_a_sentence_says_so(say):
    assert say(None) == text.NOTHING
