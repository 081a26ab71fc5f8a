"""The README says what was measured."""

import re
from pathlib import Path

from nmpcrl.bench.paired import Ratio
from nmpcrl.claims import published
from nmpcrl.claims.paper_claims import BY_TIME
from nmpcrl.claims.rule import UNDECIDABLE
from nmpcrl.claims.timing import decide
from nmpcrl.study import design

README = (Path(__file__).resolve().parents[2] / "README.md").read_text()


def test_the_table_of_claims_holds_the_published_verdicts():
    rows = dict(re.findall(r"^\| (C\d) \| .* \| (.+) \|$", README, flags=re.M))
    verdicts = {v.claim: v.outcome for v in published.load().verdicts if v.claim.startswith("C")}
    assert rows == verdicts


def test_the_numbers_of_runs_are_those_of_the_published_study():
    parts = published.load().about["runs"]
    varied = [parts[name] for name in design.VARIANTS]
    assert set(re.findall(r"(\d+) runs", README)) == {str(parts["main"]), str(sum(varied))}
    assert f"in {len(varied)} ways" in README
    assert re.search(rf"`make book` trains\s{len(design.fresh())} afresh", README)


def test_published_verdicts_on_time_are_what_their_intervals_say():
    """So the README's table speaks of intervals, and not of how busy a machine was."""
    known = [v for v in published.load().verdicts if v.claim in BY_TIME and v.ratio is not None]
    for verdict in known:
        claim, ratio = BY_TIME[verdict.claim], Ratio(verdict.ratio, *verdict.interval, waited=0.0)
        assert verdict.outcome in (UNDECIDABLE, decide(ratio, claim.claimed, claim.near)[0])
