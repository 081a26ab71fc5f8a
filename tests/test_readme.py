"""The README says what was measured."""

import re
from pathlib import Path

from nmpcrl.study import published

README = (Path(__file__).resolve().parent.parent / "README.md").read_text()


def test_the_table_of_claims_holds_the_published_verdicts():
    rows = dict(re.findall(r"^\| (C\d) \| .* \| (.+) \|$", README, flags=re.M))
    verdicts = {v.claim: v.outcome for v in published.load().verdicts if v.claim.startswith("C")}
    assert rows == verdicts


def test_the_number_of_runs_is_that_of_the_published_main_table():
    runs = published.load().about["runs"]["main"]
    assert set(re.findall(r"(\d+) runs", README)) == {str(runs)}
