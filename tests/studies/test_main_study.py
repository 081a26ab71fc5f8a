"""The runs of a chapter: trained here, published, or both."""

import numpy as np
import pytest

from nmpcrl.analysis.rows import table
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.claims import published
from nmpcrl.studies.main_study import gather, needed, publish_runs
from nmpcrl.study.design import main_table
from nmpcrl.study.experiment import frozen_arm

ASKED = {"learners": ["ES"], "layouts": ["A"], "seeds": [0], "episodes": 2}
MORE = ASKED | {"seeds": [0, 1]}


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
    publish_runs(summaries, dict.fromkeys(runs, "main"), anew=True)
    return summaries


def test_missing_runs_are_trained_with_their_frozen_arms_beside_published_ones(known):
    both = ["ES", "frozen"]
    assert needed("published", **ASKED) == ()
    assert set(needed("fresh", **ASKED)) == set(known)
    lacking = set(needed("published", **MORE))
    assert lacking == {*main_table(both, ["A"], [1], 2)} == {*map(frozen_arm, lacking), *lacking}
    found, there = gather("published", **ASKED), table(known)
    assert found.is_published
    assert (found.mark, found.origin) == ("4 runs published", "the published main table")
    for name in ("final_cost", "training_cost", "cost_ratio", "theta_8", "inside_large"):
        np.testing.assert_array_equal(found.runs[name], there[name])
    for experiment, summary in known.items():
        mine = found.summaries[experiment]
        np.testing.assert_allclose(mine.episodes["cost"], summary.episodes["cost"], rtol=1e-6)
        np.testing.assert_allclose(mine.states, summary.states, atol=1e-5)
    assert not any(len(summary.actions) for summary in found.summaries.values())
    for experiment, one in published.with_inputs(found).summaries.items():
        np.testing.assert_allclose(one.actions, known[experiment].actions, atol=1e-6)
    found = gather("published", **MORE)
    sources = found.runs.groupby("seed").source.unique()
    assert (sources[0].tolist(), sources[1].tolist()) == (["published"], ["fresh"])
    assert not found.is_published
    assert found.mark == "4 runs trained for this page, 4 runs published"
    assert (found.runs[found.runs.learner == "frozen"].cost_ratio == 1).all()
    assert set(found.main.summaries) == set(found.summaries)
    other = gather("published", **ASKED | {"learners": ["GES"]})  # beside published frozen ones
    assert other.runs[other.runs.learner == "GES"].cost_ratio.gt(0).all()
    only = found.where(found.runs.seed == 1)
    assert ({e.seed for e in only.summaries}, len(only.runs)) == ({1}, 4)
    assert gather("fresh", **ASKED).origin == "4 runs trained for this page"
