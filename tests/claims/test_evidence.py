"""A chapter's evidence: what is trained here and what is published, side by side."""

import numpy as np
import pytest

from nmpcrl.analysis.rows import table
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.claims import evidence, published
from nmpcrl.claims.evidence import gather, needed
from nmpcrl.study import ParameterError
from nmpcrl.study.design import fresh, main_table
from nmpcrl.study.experiment import frozen_arm

ASKED = {"learners": ["ES"], "layouts": ["A"], "seeds": [0], "episodes": 2}


@pytest.fixture(autouse=True)
def places(tmp_path, monkeypatch, trains_here):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "published"))
    published._load.cache_clear()


@pytest.fixture
def known():
    """ES and its frozen arm, both readings of the decay, published."""
    runs = main_table(["ES", "frozen"], ["A"], [0], 2)
    summaries = fetch_summaries(runs, progress=False)
    published.publish(summaries, dict.fromkeys(runs, "main"))
    return summaries


def test_where_nothing_is_published_no_chapter_goes_on():
    with pytest.raises(published.Damaged, match=r"nothing is published in .* restores"):
        needed("fresh", **ASKED)


def test_what_is_not_published_is_trained_with_its_frozen_arms(monkeypatch):
    monkeypatch.setattr(evidence, "load", published.Published)
    wanted = set(needed("fresh", **ASKED))
    assert wanted == {*main_table(["ES", "frozen"], ["A"], [0], 2)}
    assert {frozen_arm(e) for e in wanted} <= wanted


def test_of_the_published_study_only_what_it_lacks_is_trained(known):
    assert needed("published", **ASKED) == ()
    lacking = needed("published", **ASKED | {"seeds": [0, 3]})
    assert set(lacking) == {*main_table(["ES", "frozen"], ["A"], [3], 2)}


def test_of_fresh_runs_all_are_trained_here(known):
    assert set(needed("fresh", **ASKED)) == set(known)


def test_the_published_runs_that_a_build_trains_again_are_those_of_the_design(monkeypatch):
    runs = main_table(["ES", "frozen"], ["A", "F"], [0, 1])
    monkeypatch.setattr(evidence, "load", lambda: published.Published(dict.fromkeys(runs)))
    again = evidence.repeatable(True, learners=["ES"], layouts=["A", "F"], seeds=[0, 1])
    assert set(again) == set(runs) & set(fresh())
    assert {(e.layout, e.seed) for e in again} == {("A", 0), ("A", 1), ("F", 0)}
    assert evidence.repeatable(True, learners=["ES"], layouts=["A"], seeds=[0], episodes=4) == ()
    assert evidence.repeatable(False, learners=["ES"], layouts=["A"], seeds=[0]) == ()
    with pytest.raises(ParameterError, match="repeat = 'no' must be true or false"):
        evidence.repeatable("no")


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"source": "stale"}, "study = 'stale' must be one of published, fresh"),
        ({"layouts": ["Z"]}, "layout = 'Z'"),
        ({"seeds": []}, "must name at least one seed"),
        ({"seeds": "[3]"}, "arrived as text"),
        ({"learners": ["SARSA"]}, "learner = 'SARSA'"),
        ({"episodes": 0}, "episodes = 0"),
    ],
)
def test_nonsense_is_refused_in_a_sentence(wrong, named):
    asked = {"source": "fresh", **ASKED, **wrong}
    with pytest.raises(ParameterError) as caught:
        needed(asked.pop("source"), **asked)
    assert named in str(caught.value)


def test_published_runs_say_what_they_said_when_they_were_trained(known):
    found = gather("published", **ASKED)
    told = table(known)
    assert set(found.runs.source) == {"published"}
    assert found.mark == "4 runs published"
    for name in ("final_cost", "training_cost", "cost_ratio", "theta_8", "inside_large"):
        np.testing.assert_array_equal(found.runs[name], told[name])
    for experiment, summary in known.items():
        there = found.summaries[experiment]
        np.testing.assert_allclose(there.episodes["cost"], summary.episodes["cost"], rtol=1e-6)
        np.testing.assert_allclose(there.states, summary.states, atol=1e-5)
        assert there.evaluations["episode"].tolist() == summary.evaluations["episode"].tolist()


def test_what_is_published_is_what_is_shown_whatever_was_trained_here(known):
    fetch_summaries(known, progress=False)  # stored here, too
    assert set(gather("published", **ASKED).runs.source) == {"published"}


def test_whose_runs_are_shown_is_known(known):
    assert gather("published", **ASKED).is_published
    assert not gather("fresh", **ASKED).is_published
    assert not gather("published", **ASKED | {"seeds": [0, 1]}).is_published
    assert gather("fresh", **ASKED).mark == "4 runs trained for this page"


def test_inputs_that_are_not_published_are_those_of_the_final_theta(known):
    found = gather("published", **ASKED)
    assert {summary.actions for summary in found.summaries.values()} == {None}
    whole = evidence.with_inputs(found)
    for experiment, summary in known.items():
        np.testing.assert_allclose(whole.summaries[experiment].actions, summary.actions, atol=1e-6)
    assert len(whole.runs) == len(known)


def test_runs_trained_here_stand_beside_published_ones(known):
    found = gather("published", **ASKED | {"seeds": [0, 1]})
    sources = found.runs.groupby("seed").source.unique()
    assert sources[0].tolist() == ["published"]
    assert sources[1].tolist() == ["fresh"]
    assert found.mark == "4 runs trained for this page, 4 runs published"
    assert (found.runs[found.runs.learner == "frozen"].cost_ratio == 1).all()
    assert set(found.main.summaries) == set(found.summaries)
    only = found.where(found.runs.seed == 1)
    assert {e.seed for e in only.summaries} == {1}
    assert len(only.runs) == 4


def test_numbers_of_the_published_main_table_are_called_so(known):
    assert gather("published", **ASKED).origin == "the published main table"
    assert gather("fresh", **ASKED).origin == (
        "4 runs trained for this page, of ES, frozen; layouts A; noise per step, episode"
    )
