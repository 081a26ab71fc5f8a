"""`nmpcrl study --population` as a user calls it."""

import shutil

import pandas as pd
import pytest
from driver.project import ROOT

from nmpcrl.analysis.difficulty import MEASURES
from nmpcrl.claims import population_published
from nmpcrl.claims.published import place
from nmpcrl.study.drawn import JUDGE, LAYOUTS
from nmpcrl.study.population_design import COMPARED, seeds, whole_population


def test_a_dry_run_counts_the_runs_of_the_population(command):
    said = command("study", "--population", "--dry-run")
    assert said.exit_code == 0, said.output
    assert f"0 of {len(whole_population()):,} runs" in said.output


def test_the_parts_are_those_of_the_population(command):
    said = command("study", "--population", "--part", "tune", "--dry-run")
    assert "0 of 360 runs" in said.output
    refused = command("study", "--population", "--part", "main")
    assert refused.exit_code == 1
    assert "the parts are judge, tune, N = 20" in refused.output


def test_what_is_not_published_is_not_judged(command):
    refused = command("study", "--population", "--judge")
    assert refused.exit_code == 1
    assert "nmpcrl study --population --publish" in refused.output


@pytest.mark.usefixtures("published")
def test_what_is_published_is_judged_and_what_is_missing_is_left_undecided(command):
    judged = command("study", "--population", "--judge")
    assert judged.exit_code == 0, judged.output
    assert "C9: 1 of 1 layouts, 100%" in judged.output
    assert "predictors: not decidable here" in judged.output
    tried = population_published.load().tried
    assert f"whole picture: contradicted (settings 0 of {len(tried)})" in judged.output
    assert (~tried.layout.isin([*"ABCDEF"])).sum() == 2


@pytest.fixture
def published(command, made_up):
    """One layout of the population with all learners, beside the study of A to F as it is."""
    there = shutil.ignore_patterns("population*")
    shutil.copytree(ROOT / "book" / "published", place(), ignore=there)
    layouts = pd.DataFrame(0.5, index=[*LAYOUTS], columns=[*MEASURES])
    for horizon in (10, 20, 40):
        layouts[f"stops_{horizon}"] = pd.Series(dict.fromkeys(COMPARED, 0.2))
    found = made_up(layouts=(JUDGE["J001"],), seeds=seeds("J001"))
    population_published.publish(found.summaries, layouts)
