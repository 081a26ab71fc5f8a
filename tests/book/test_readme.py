"""The README says what was measured, and its commands and examples work."""

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from nmpcrl.claims import published
from nmpcrl.claims.finding import finding
from nmpcrl.claims.paper_claims import BY_RUNS, CLAIMS, kept_without_noise
from nmpcrl.report.timing import ratios_at_paper_speed

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()
TEXT = README.replace("\n", " ")
EXAMPLES = re.findall(r"^```python\n(.*?)^```$", README, flags=re.M | re.S)
COUNTED = ("none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


def claims() -> dict[str, str]:
    """The published outcome of each of the paper's claims."""
    verdicts = published.load().verdicts
    return {v.claim: v.words for v in verdicts if v.claim.startswith("C")}


def test_the_table_of_claims_and_the_first_paragraph_hold_the_published_verdicts():
    rows = dict(re.findall(r"^\| (C\d) \| .* \| (.+) \|$", README, flags=re.M))
    assert rows == claims()
    count = Counter(claims().values())
    found = re.search(
        r"(\w+) claims were tested: (\w+) that the paper makes, and (\w+) that it implies\."
        r" (\w+) (?:is|are) reproduced, (\w+) partly, (\w+) not\.",
        TEXT,
    )
    outcomes = ("reproduced", "partly reproduced", "not reproduced")
    implied, made = sum(one.implied for one in CLAIMS.values()), len(claims())
    expected = [made, made - implied, implied, *(count[outcome] for outcome in outcomes)]
    assert found
    assert [COUNTED.index(word.lower()) for word in found.groups()] == expected


def test_halves_of_c1_numbers_in_sentences_and_the_commit_are_the_published_ones():
    said = re.search(
        r"every step, (\d+) of (\d+) DES runs and (\d+) of \d+ RDES\s+runs diverge;.*?"
        r" every episode, (\d+) and (\d+), .*? p =\s+(0\.\d+)",
        TEXT,
    )
    *numbers, p = said.groups()
    assert f"{published.load().verdict('C1').own_halves[1].p:.2f}" == p
    des, of, rdes, des_episode, rdes_episode = map(int, numbers)
    counts = {
        one.decay: (one.pairs, *one.counts)
        for one in published.load().verdict("C1").halves
        if one.wrong == "diverged"
    }
    assert counts == {"step": (of, des, rdes), "episode": (of, des_episode, rdes_episode)}
    known, found = published.load(), finding(published.load())
    slow = "{:.2f} to {:.2f} at the paper's".format(*ratios_at_paper_speed(known.timings))
    kept = kept_without_noise(known.main.runs, BY_RUNS["C7"].learners).kept
    always, of = known.verdict("C7").counts["all"]
    arrived, layouts = found.by_hand
    low, high = (f"{100 * lost:.0f}" for lost in found.lost_by_hand)
    for said in (
        f"the {known.parts['main']} runs",
        f"{known.verdict('C3').ratio:.2f} with our faster Ipopt, {slow}",
        f"{kept.sum()} of {of} RDES runs keep the constraints without noise; in training, too,"
        f" {always} do",
        f"saves {100 * found.saved_by_hand:.0f} % in the {arrived} of {layouts} layouts in which"
        f" the robot still arrives, where learning saves {100 * found.saved_there:.0f} %; in the"
        f" other {layouts - arrived} it costs {low} to {high} % more",
    ):
        assert said in TEXT
    (commit,) = re.findall(r"fixed\s+in\s+commit\s+`(\w+)`", README)
    assert published.load().about["fixed"]["thresholds"]["hash"].startswith(commit)


@pytest.mark.parametrize("page", ["README.md", "book/intro.md"])
def test_the_picture_is_described_by_its_finding_with_its_own_numbers(page):
    (said,) = re.findall(
        r"!\[([^]]+)\]\((?:book/)?_static/closed_loop\.svg\)", (ROOT / page).read_text()
    )
    picture = (ROOT / "book/_static/closed_loop.svg").read_text()
    (title,) = re.findall(r"<!-- (Plans of [^>]*) -->", picture)
    assert re.findall(r"[\d.]+ m", said) == re.findall(r"[\d.]+ m", title) != []


def test_times_are_ratios_of_the_published_measurement():
    times = published.load().timings.set_index(["solver", "learner"]).ms_per_step
    times = times.xs("ES", level="learner")
    slower = tuple(f"{times[solver] / times['riccati']:.0f}" for solver in ("ipopt", "fatrop"))
    found = r"ES takes (\d+) times as long with Ipopt and (\d+) times as long with fatrop"
    assert re.findall(found, TEXT) == [slower]


def test_the_example_learns_what_the_text_says(capsys):
    (example,) = EXAMPLES
    exec(example, names := {})
    result = names["result"]
    said = re.search(r"a gain of ([\d.]+), and the cost .* from ([\d.]+) to ([\d.]+)\.", README)
    found = result.theta["gain"], result.costs[0], result.costs[-1]
    np.testing.assert_allclose(found, list(map(float, said.groups())), atol=0.005)
    assert "gain" in capsys.readouterr().out


def test_the_way_of_imports_names_every_package_and_links_lead_to_files():
    rooms = {path.name for path in (ROOT / "nmpcrl").iterdir() if (path / "__init__.py").is_file()}
    (way,) = re.findall(r"`(\w+ -> [^`]+)`", README)
    assert set(re.findall(r"\w+", way)) == rooms
    for target in re.findall(r"\]\(([^):]+)\)", README):
        assert (ROOT / target).is_file(), target
