"""The README says what was measured."""

import re
from pathlib import Path

from nmpcrl.claims import published
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
