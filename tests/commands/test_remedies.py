"""`nmpcrl remedies` as a user calls it."""

import pytest

from nmpcrl.claims import remedy_published
from nmpcrl.claims.remedies import COLUMNS
from nmpcrl.claims.remedy_questions import PARTS


@pytest.fixture(autouse=True)
def here(trains_here):
    """Everything in this process."""


def test_a_dry_run_counts_the_runs_and_says_what_they_take(command):
    said = command("remedies", "--dry-run", "--entry", "ES")
    assert said.exit_code == 0, said.output
    assert "tune: 0 of 60 runs are stored; the others take about" in said.stdout
    assert "judge 50: 0 of 240 runs" in said.stdout
    assert "all that is missing: about" in said.stdout


def test_what_there_is_not_is_refused_with_what_there_is(command):
    refused = command("remedies", "--part", "all")
    assert refused.exit_code == 1
    assert "there is no part 'all'; there are best, tune, judge 50" in refused.stderr
    assert "there is no entry 'SAC'" in command("remedies", "--entry", "SAC").stderr


def test_nothing_is_judged_before_it_is_tuned(command):
    refused = command("remedies", "--part", "judge 50", "--entry", "ES")
    assert refused.exit_code == 1
    assert "ES is not tuned yet" in refused.stderr


def test_what_is_not_published_is_not_advised_on(command):
    refused = command("remedies", "--judge")
    assert refused.exit_code == 1
    assert "nmpcrl remedies --publish" in refused.stderr


def test_what_is_published_is_advised_on(command):
    import pandas as pd

    one = PARTS["judge 50"]
    rows = [
        {**dict.fromkeys(COLUMNS, 0), "part": "judge 50", "entry": "grid", "name": "grid",
         "layout": layout, "k": k, "initial": 4000.0, "best": 3000.0, "cost": 3200.0,
         "arrived": True, "episodes": 11, "over": False, "seconds": 0.25}
        for layout in one.layouts
        for k in range(one.seeds)
    ]  # fmt: skip
    remedy_published.extend(pd.DataFrame(rows, columns=[*COLUMNS]))
    said = command("remedies", "--judge")
    assert said.exit_code == 0, said.output
    _, row, *others = said.stdout.splitlines()
    assert row.split()[:4] == ["grid", "first", "0.80", "[0.80,"]
    assert "one number by hand: not decidable here (0 of 0 layouts)" in others
