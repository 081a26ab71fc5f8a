"""The README says what was measured, and its commands and examples work."""

import re
from collections import Counter
from functools import partial
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nmpcrl.bench.learners import ratio as ratio_of
from nmpcrl.bench.paired import Ratio
from nmpcrl.claims import published
from nmpcrl.claims.finding import finding
from nmpcrl.claims.paper_claims import BY_RUNS, BY_TIME, CLAIMS, kept_without_noise
from nmpcrl.claims.rule import anew
from nmpcrl.claims.timing import decide
from nmpcrl.claims.verdict import UNDECIDABLE
from nmpcrl.control import Nmpc
from nmpcrl.report.timing import ratios_at_paper_speed
from nmpcrl.study import design

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()
EXAMPLES = re.findall(r"^```python\n(.*?)^```$", README, flags=re.M | re.S)
COUNTED = ("none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


def claims() -> dict[str, str]:
    """The published outcome of each of the paper's claims."""
    verdicts = published.load().verdicts
    return {v.claim: v.words for v in verdicts if v.claim.startswith("C")}


def test_the_table_of_claims_holds_the_published_verdicts():
    rows = dict(re.findall(r"^\| (C\d) \| .* \| (.+) \|$", README, flags=re.M))
    assert rows == claims()


def test_the_first_paragraph_counts_the_published_verdicts():
    count = Counter(claims().values())
    found = re.search(
        r"(\w+) claims were tested: (\w+) that the paper makes, and (\w+) that it takes for"
        r" granted\. (\w+) (?:is|are) reproduced, (\w+) partly, (\w+) not\.",
        README.replace("\n", " "),
    )
    outcomes = ("reproduced", "partly reproduced", "not reproduced")
    implied, made = sum(one.implied for one in CLAIMS.values()), len(claims())
    expected = [made, made - implied, implied, *(count[outcome] for outcome in outcomes)]
    assert found
    assert [COUNTED.index(word.lower()) for word in found.groups()] == expected


def test_the_numbers_of_runs_are_those_of_the_published_study():
    parts = published.load().parts
    varied = [parts[name] for name in design.VARIANTS if name in parts]
    assert set(re.findall(r"(\d+) runs", README)) == {str(parts["main"]), str(sum(varied))}
    assert f"in {len(varied)} ways" in README
    assert re.search(rf"`make book` trains\s{len(design.fresh())} afresh", README)


def test_the_halves_of_c1_are_those_of_the_published_verdict():
    said = re.search(
        r"every step, (\d+) of (\d+) DES runs and (\d+) of \d+ RDES runs diverge;.*? every episode,"
        r" (\d+) and (\d+), .*? p = (0\.\d+)",
        README.replace("\n", " "),
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


def test_c1_and_c3_are_said_with_both_of_their_intervals():
    text, known = README.replace("\n", " "), published.load()
    one, other = known.verdict("C1"), anew(known.verdict("C1"))
    bounds = [f"{100 * end:.0f}" for end in (one.share, *one.interval, other.low, other.high)]
    said = "in {} % of pairs of runs, {} to {} % with other seeds and {} to {} % with other layouts"
    assert said.format(*bounds) in text
    slow = "{:.2f} to {:.2f} at the paper's".format(*ratios_at_paper_speed(known.timings))
    assert f"{known.verdict('C3').ratio:.2f} with our faster Ipopt, {slow}" in text


def test_c7_is_said_with_both_of_its_questions():
    known = published.load()
    kept = kept_without_noise(known.main.runs, BY_RUNS["C7"].learners).kept
    always, of = known.verdict("C7").counts["all"]
    said = (
        f"{kept.sum()} of {of} RDES runs keep the constraints without noise; in training, too,"
        f" {always} do"
    )
    assert said in README.replace("\n", " ")


def test_one_number_by_hand_is_said_with_the_layouts_in_which_it_fails():
    found = finding(published.load())
    said = (
        f"saves {100 * found.saved_by_hand:.0f} % in the {found.by_hand[0]} of {found.by_hand[1]}"
        f" layouts in which the robot still arrives, where learning saves"
        f" {100 * found.saved_there:.0f} %; in the other"
        f" {found.by_hand[1] - found.by_hand[0]} it costs {100 * found.lost_by_hand[0]:.0f} to"
        f" {100 * found.lost_by_hand[1]:.0f} % more"
    )
    assert said in README.replace("\n", " ")


def test_the_commit_of_the_thresholds_is_the_published_one():
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


def test_published_verdicts_on_time_are_what_their_intervals_say():
    """So the README's table speaks of intervals, and not of how busy a machine was."""
    known = [verdict for verdict in published.load().verdicts if verdict.claim in BY_TIME]
    assert len(known) == len(BY_TIME)
    for verdict in known:
        claim, ratio = BY_TIME[verdict.claim], Ratio(verdict.ratio, *verdict.interval, waited=0.0)
        assert verdict.outcome == decide(ratio, claim.claimed, claim.near) != UNDECIDABLE


def test_times_are_ratios_first_and_those_of_the_published_measurement():
    found, said = published.load(), README.replace("\n", " ")
    table = found.timings.set_index(["solver", "learner"])
    times = table.ms_per_step.xs("ES", level="learner")
    slower = [f"{times[solver] / times['riccati']:.0f}" for solver in ("ipopt", "fatrop")]
    ratio = f"{ratio_of(found.timings, 'ipopt', 'RDES').value:.2f}"
    assert re.findall(r"ES takes (\d+) times .* and (\d+) times as long with fatrop", said) == [
        tuple(slower)
    ]
    assert re.findall(r"RDES takes ([\d.]+) of the time of one of ES", said) == [ratio]


def test_seconds_of_a_run_are_those_of_the_published_steps_and_name_their_processor():
    found = published.load()
    hours = found.timings.set_index(["solver", "learner"]).hours
    seconds = [f"{3600 * hours['riccati', learner]:.0f}" for learner in ("ES", "RDES")]
    said = re.findall(
        r"of that measurement \(([^)]+)\) a run of 300 episodes takes about (\d+) seconds for ES"
        r" and (\d+) for RDES",
        README.replace("\n", " "),
    )
    assert said == [(found.timed["machine"]["processor"], *seconds)]
    assert len(re.findall(r"seconds|microseconds|µs", README)) == 1


def test_the_example_trains_a_plant_of_the_readers_own_as_the_text_says(capsys):
    names: dict = {}
    exec(EXAMPLES[0], names)
    before, after = map(float, re.findall(r"cost without noise: (\d+)", capsys.readouterr().out))
    said = re.search(r"the cost without noise from (\d+) to (\d+)\.", README)
    np.testing.assert_allclose([before, after], [float(cost) for cost in said.groups()], atol=1)
    assert names["explore"].scale.shape == (40, 60)  # "Forty episodes of 60 steps"


def test_the_second_example_learns_each_parameter_of_its_problem(capsys):
    names = {"ca": ca, "np": np, "Nmpc": partial(Nmpc, solver="fatrop")}  # which compiles nothing
    exec(EXAMPLES[1], names)
    learned, problem = names["result"].vector, names["problem"]
    assert set(problem.split(learned)) == {"A", "B", "b", "margin"}
    assert all((learned != problem.theta).reshape(-1)[:4])
    assert np.isfinite(learned).all()
    assert "margin" in capsys.readouterr().out


def test_the_layout_names_every_room_and_the_way_of_imports():
    rooms = {path.name for path in (ROOT / "nmpcrl").iterdir() if (path / "__init__.py").is_file()}
    assert set(re.findall(r"^nmpcrl/(\w+)/ ", README, flags=re.M)) == rooms
    (way,) = re.findall(r"`(\w+ -> [^`]+)`", README)
    assert set(re.findall(r"\w+", way)) == rooms


def test_links_lead_to_files():
    for target in re.findall(r"\]\(([^):]+)\)", README):
        assert (ROOT / target).is_file(), target
