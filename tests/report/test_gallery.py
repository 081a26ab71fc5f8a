"""The gallery: six finds, each of which is there where its sentence says it is."""

import json
import re

import numpy as np
import pytest

from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.claims import published
from nmpcrl.report.finds import SETTINGS
from nmpcrl.report.gallery import REPEATED, gallery
from nmpcrl.study import Experiment, paper

TITLES = (
    "A gap that closes",
    "A run that overshoots",
    "A kink",
    "DES fails, RDES does not",
    "RDES fails, DES does not",
    "A tie",
)


@pytest.fixture(scope="module")
def study():
    return published.load()


@pytest.fixture(scope="module")
def finds(study):
    return {one.title: one for one in gallery(study)}


def test_there_are_six(finds):
    assert tuple(finds) == TITLES


@pytest.mark.parametrize("title", TITLES)
def test_the_settings_are_json_and_name_the_run(finds, title):
    find = finds[title]
    settings = json.loads(json.dumps(find.settings))
    assert set(settings) == {*SETTINGS, "layout"}
    assert Experiment(**settings).canonical == find.experiment.canonical
    assert settings["learner"] in (*REPEATED, title.split()[0])
    assert 1 <= len(settings["layout"]) <= 8
    assert not re.search(r"[{}]|nan|inf", find.sentence)


def test_the_gap_is_open_at_first_and_closed_at_the_end(finds, study):
    find = finds["A gap that closes"]
    closes = find.numbers["closes_at"]
    assert find.experiment.theta[-1] < closes < find.numbers["theta_c"]
    last = study.summaries[find.experiment].states
    assert closes_at(find.experiment.task, last[:, :2]) > find.numbers["theta_c"]
    assert find.numbers["last"] > 1.5 * find.numbers["first"]


def test_no_published_run_that_a_page_trains_overshoots_more(finds, study):
    find = finds["A run that overshoots"]
    assert study.rows[find.experiment]["over"] == find.numbers["share"] > 0.01
    trained = [row for row in study.rows.values() if row["learner"] in ("ES", "GES")]
    assert find.numbers["share"] == max(row["over"] for row in trained)


def test_the_gradient_jumps_by_omega_where_the_start_is_on_the_boundary(finds):
    find = finds["A kink"]
    assert find.experiment.task.overlap(find.experiment.start) + find.experiment.theta[-1] == 0
    np.testing.assert_allclose(find.numbers["jump"], paper.SLACK_WEIGHT, rtol=1e-3)


def test_the_two_plans_are_mirrored_and_cost_the_same(finds):
    numbers = finds["A tie"].numbers
    np.testing.assert_allclose(numbers["one"], numbers["other"], rtol=1e-9)
    assert numbers["apart"] > 2.4  # the obstacle with its circle is 2.5 m wide
    assert numbers["between"] > 2 * numbers["one"]


@pytest.mark.parametrize("title", TITLES[3:5])
def test_one_learner_fails_where_the_other_does_not(finds, study, title):
    find, (wrong, _, well) = finds[title], title.replace(",", "").split()[:3]
    assert find.numbers["wrong"] > find.numbers["well"]
    other = Experiment(**vars(find.experiment) | {"learner": well})
    assert study.rows[find.experiment]["wrong"]
    assert not study.rows[other]["wrong"]
    assert find.experiment.learner == wrong
    assert wrong in find.sentence


def test_without_a_study_there_are_the_two_that_are_made():
    assert [one.title for one in gallery(published.Published())] == ["A kink", "A tie"]
