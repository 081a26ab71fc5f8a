"""The gallery: six examples, each of which is there where its sentence says it is."""

import json
import re

import numpy as np
import pytest

from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.claims import published
from nmpcrl.report.examples import SETTINGS
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
def shown(study):
    return {one.title: one for one in gallery(study)}


@pytest.mark.parametrize("title", TITLES)
def test_the_settings_are_json_and_name_the_run(shown, title):
    example = shown[title]
    settings = json.loads(json.dumps(example.settings))
    assert set(settings) == {*SETTINGS, "layout"}
    assert Experiment(**settings).canonical == example.experiment.canonical
    assert settings["learner"] in (*REPEATED, title.split()[0])
    assert 1 <= len(settings["layout"]) <= 8
    said = (example.sentence + example.look).replace("{c}", "")  # the page writes its symbol
    assert not re.search(r"[{}_]|nan|inf", said)
    assert example.look.startswith("Look at ")


def test_the_gap_is_open_at_first_and_closed_at_the_end(shown, study):
    example = shown["A gap that closes"]
    closes = example.numbers["closes_at"]
    assert example.experiment.theta[-1] < closes < example.numbers["theta_c"]
    last = study.summaries[example.experiment].states
    assert closes_at(example.experiment.task, last[:, :2]) > example.numbers["theta_c"]
    assert example.numbers["last"] > 1.5 * example.numbers["first"]


def test_no_published_run_that_a_page_trains_overshoots_more(shown, study):
    example = shown["A run that overshoots"]
    assert study.rows[example.experiment]["over"] == example.numbers["share"] > 0.01
    trained = [row for row in study.rows.values() if row["learner"] in ("ES", "GES")]
    assert example.numbers["share"] == max(row["over"] for row in trained)


def test_the_gradient_jumps_by_omega_where_the_start_is_on_the_boundary(shown):
    example = shown["A kink"]
    assert (
        example.experiment.task.overlap(example.experiment.start) + example.experiment.theta[-1]
        == 0
    )
    np.testing.assert_allclose(example.numbers["jump"], paper.SLACK_WEIGHT, rtol=1e-3)


def test_the_two_plans_are_mirrored_and_cost_the_same(shown):
    numbers = shown["A tie"].numbers
    np.testing.assert_allclose(numbers["one"], numbers["other"], rtol=1e-9)
    assert numbers["apart"] > 2.4  # the obstacle with its circle is 2.5 m wide
    assert numbers["one"] < numbers["between"] < 1.1 * numbers["one"]
    assert numbers["restarts"] > 0


@pytest.mark.parametrize("title", TITLES[3:5])
def test_one_learner_fails_where_the_other_does_not(shown, study, title):
    example, (wrong, _, well) = shown[title], title.replace(",", "").split()[:3]
    assert example.numbers["wrong"] > example.numbers["well"]
    other = Experiment(**vars(example.experiment) | {"learner": well})
    assert study.rows[example.experiment]["wrong"]
    assert not study.rows[other]["wrong"]
    assert example.experiment.learner == wrong
    assert example.against == other
    assert wrong in example.sentence
