"""A chapter's evidence: what is trained here and what is published, side by side."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.analysis.summary import table
from nmpcrl.claims import evidence, failure_modes, published
from nmpcrl.claims.evidence import gather, needed
from nmpcrl.study import Experiment, ParameterError, Runs
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
    published.publish(summaries, dict.fromkeys(runs, "main"), ())
    return summaries


def test_where_nothing_is_published_no_chapter_goes_on():
    with pytest.raises(published.Damaged, match=r"nothing is published in .* restores"):
        needed("fresh", **ASKED)


def test_what_is_not_published_is_trained_with_its_frozen_arms(monkeypatch):
    monkeypatch.setattr(evidence, "load", published.Published)
    wanted = set(needed("fresh", **ASKED))
    assert wanted == {*main_table(["ES", "frozen"], ["A"], [0], 2)}
    assert {frozen_arm(e) for e in wanted} <= wanted


def test_what_is_not_published_cannot_be_read(known):
    assert needed("published", **ASKED) == ()
    with pytest.raises(ParameterError, match=r"holds no run of ES in layout A.*seed 3"):
        needed("published", **ASKED | {"seeds": [3]})


def test_of_what_is_published_only_the_fresh_part_is_trained_again(monkeypatch):
    runs = main_table(["ES", "frozen"], ["A", "F"], [0])
    monkeypatch.setattr(evidence, "load", lambda: published.Published(dict.fromkeys(runs)))
    wanted = needed("fresh", learners=["ES"], layouts=["A", "F"], seeds=[0])
    assert set(wanted) == set(runs) & set(fresh())
    assert {e.layout for e in wanted} == {"A"}


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"source": "stale"}, "study = 'stale' must be one of fresh, published"),
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


def test_runs_trained_here_stand_beside_published_ones(known):
    found = gather("fresh", **ASKED | {"seeds": [0, 1]})
    sources = found.runs.groupby("seed").source.unique()
    assert sources[0].tolist() == ["published"]
    assert sources[1].tolist() == ["fresh"]
    assert found.mark == "4 runs trained for this page, 4 runs published"
    assert (found.runs[found.runs.learner == "frozen"].cost_ratio == 1).all()
    assert set(found.main.summaries) == set(found.summaries)
    only = found.where(found.runs.seed == 1)
    assert {e.seed for e in only.summaries} == {1}
    assert len(only.runs) == 4


def test_of_each_mechanism_the_first_run_that_went_wrong_is_an_example_trained_here_before_others():
    experiments = [Experiment("ES", seed=seed) for seed in range(5)]
    runs = pd.DataFrame(
        {
            "mechanism": ["", "gap", "gap", failure_modes.WELL, "overshoot"],
            "source": ["fresh", "published", "fresh", "published", "published"],
        }
    )
    found = evidence.Evidence(Runs(dict.fromkeys(experiments)), runs)
    assert list(found.wrong.run) == [experiments[k] for k in (2, 1, 4)]
    assert found.examples == {"gap": experiments[2], "overshoot": experiments[4]}
