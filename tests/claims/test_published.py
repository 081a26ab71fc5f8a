"""The published study: read as written, extended without a change, judged when it is read."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from builders import scaled, timings

from nmpcrl.analysis.rows import row
from nmpcrl.analysis.search import SearchResult
from nmpcrl.analysis.summary import summarise
from nmpcrl.claims import published
from nmpcrl.claims.assumptions import Measurement
from nmpcrl.claims.published import FOLLOWED, Published, load
from nmpcrl.studies import main_study
from nmpcrl.study import Experiment, paper, run, sweep
from nmpcrl.study import published as store
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.machine import fingerprint
from nmpcrl.study.provenance import EPOCHS, environment, summary_key
from nmpcrl.study.published import Unpublishable

SMALL = {"episodes": 4, "steps": 6, "evaluate_every": 2}
RUNS = (
    *sweep(learner=("ES", "frozen"), seed=(0, 1), **SMALL),
    *sweep(learner=("ES", "frozen"), horizon=2, **SMALL),
    Experiment("frozen", episodes=7, steps=9, evaluate_every=1),
)
LABELS = {e: "main" if e.horizon == paper.HORIZON else "N = 2" for e in RUNS}
TIMES = timings(0.65, width=0.02, waited=0.5, solvers=["ipopt"])
SEARCHES = {"B": SearchResult((0.1, 1 / 3), 31, (1, 7), (1 / 3, 0.1))}
AUDIT = Measurement(0.1, 2 / 3, 0.5)


@pytest.fixture(scope="module")
def summaries():
    """A small study; one rollout failed, and its text has all separators."""
    found = {e: summarise(run(e)) for e in RUNS}
    one, states = found[RUNS[0]], found[RUNS[0]].states.copy()
    states[2:] = np.nan
    evaluations = one.evaluations | {"cost": np.array([5.0, np.inf, np.inf])}
    facts = one.facts | {"stopped": 'diverged: ", | "'}
    found[RUNS[0]] = replace(one, evaluations=evaluations, states=states, facts=facts)
    return found


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "published"))
    forget()
    return tmp_path / "published"


@pytest.fixture
def known(summaries, folder) -> Published:
    publish_all(summaries)
    return load()


def publish_all(summaries) -> None:
    main_study.publish_runs(summaries, LABELS, anew=True, audit=AUDIT)
    main_study.publish_times(TIMES)
    main_study.publish_searches(SEARCHES)


def forget() -> None:
    """Files are read again."""
    for cached in (published._load, store._manifest, store._table, store._arrays):
        cached.cache_clear()


def test_rows_curves_searches_times_and_their_origin_are_read_as_they_were(known, summaries):
    assert list(known.rows) == list(known.summaries) == list(RUNS)
    for e, one in summaries.items():
        labels = {"key": summary_key(e), "variant": LABELS[e], "source": "published"}
        for name, value in {**row(one), **labels}.items():
            np.testing.assert_equal(known.rows[e][name], value)
        assert (known.rows[e]["ending"] == "") == (e.learner == "frozen")
        found, columns = known.summaries[e], ["cost", *["theta"] * (LABELS[e] in FOLLOWED)]
        assert (found.name, found.facts["stopped"]) == (e, one.facts["stopped"])
        assert [*found.episodes] == columns
        pairs = [(found.states, one.states)]
        pairs += [(found.evaluations[k], one.evaluations[k]) for k in found.evaluations]
        pairs += [(found.episodes[k], one.episodes[k]) for k in columns]
        for there, here in pairs:
            assert there.shape == here.shape
            np.testing.assert_array_equal(there, here.astype(there.dtype))
    assert len(known.main.runs) == sum(label == "main" for label in LABELS.values())
    assert known.searches == SEARCHES
    pd.testing.assert_frame_equal(known.timings, TIMES, check_dtype=False, check_exact=True)
    (batch,) = known.batches
    made = {"epochs": EPOCHS, "machine": fingerprint(), "versions": environment()}
    assert {name: batch[name] for name in made} == made
    assert {name: known.timed[name] for name in made} == made
    assert known.parts == {"main": 5, "N = 2": 2}
    assert batch["audit"] == {"kinks": 0.1, "memory": 2 / 3, "dropped": 0.5}
    assert store.about("searches")["batches"][0]["machine"] == fingerprint()


def test_the_same_content_gives_the_same_bytes_and_nothing_of_the_earlier(known, summaries, folder):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    fewer = [RUNS[0], frozen_arm(RUNS[0])]
    main_study.publish_runs({e: summaries[e] for e in fewer}, LABELS, anew=True)
    assert list(load().rows) == fewer
    shutil.rmtree(folder)
    forget()
    publish_all(summaries)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


FURTHER = Experiment("ES", alpha=2e-7, **SMALL)


def test_further_runs_are_added_and_the_published_ones_stay(known, folder):
    made = summarise(run(FURTHER))
    main_study.publish_runs({FURTHER: made}, {FURTHER: "alpha x 2"})
    forget()
    found = load()
    assert list(found.rows) == [*RUNS, FURTHER]
    np.testing.assert_equal({e: found.rows[e] for e in RUNS}, dict(known.rows))
    for e in RUNS:
        np.testing.assert_equal(vars(found.summaries[e]), vars(known.summaries[e]))
    assert found.rows[FURTHER]["final_cost"] == row(made)["final_cost"]
    assert found.rows[FURTHER]["ending"]
    np.testing.assert_array_equal(found.summaries[FURTHER].states, made.states.astype("f4"))
    assert [one["runs"] for one in found.batches] == [known.parts, {"alpha x 2": 1}]
    assert (found.searches, found.timed) == (known.searches, known.timed)


@pytest.mark.parametrize(
    ("experiment", "part", "refusal"),
    [
        (RUNS[0], "N = 2", "is published already, in the part 'main'"),
        (replace(FURTHER, seed=7), "N = 2", "frozen in layout A, .* seed 7 is compared, is not"),
    ],
)
def test_runs_that_cannot_stand_beside_the_others_are_refused(known, experiment, part, refusal):
    made = summarise(run(experiment))
    with pytest.raises(Unpublishable, match=refusal):
        main_study.publish_runs({experiment: made}, {experiment: part})
    assert list(load().rows) == list(RUNS)


def test_a_part_of_earlier_epochs_is_replaced_as_a_whole_and_the_others_stay(
    known, folder, summaries, monkeypatch
):
    monkeypatch.setitem(EPOCHS, "control", EPOCHS["control"] + 1)
    audit, main = replace(AUDIT, kinks=0.2), {e: LABELS[e] for e in RUNS if LABELS[e] == "main"}
    anew = {e: scaled(summaries[e], 2.0) for e in main}
    with pytest.raises(Unpublishable, match=r"is missing: the part 'main' is of earlier epochs"):
        main_study.publish_runs(dict([*anew.items()][1:]), main)
    main_study.publish_runs(anew, main, audit=audit)
    forget()
    found = load()
    assert list(found.rows) == list(RUNS)
    assert [store.is_current("runs", part) for part in ("main", "N = 2")] == [True, False]
    for e in RUNS:
        factor = 2.0 if e in main else 1.0
        np.testing.assert_equal(
            found.rows[e]["initial_cost"], factor * row(summaries[e])["initial_cost"]
        )
    assert [one["runs"] for one in found.batches] == [{"N = 2": 2}, {"main": 5}]
    assert [one.get("audit", {}).get("kinks") for one in found.batches] == [None, 0.2]
    assert sum(one["hours"] for one in found.batches) == pytest.approx(
        found.runs.seconds.sum() / 3600
    )
    with pytest.raises(Unpublishable, match="is published already, in the part 'main'"):
        main_study.publish_runs(anew, main)


def test_times_that_leave_a_claim_open_are_not_published(known):
    with pytest.raises(Unpublishable, match="leave C3 open"):
        main_study.publish_times(timings(0.65, width=0.07, waited=0.5, solvers=["ipopt"]))
    pd.testing.assert_frame_equal(load().timings, known.timings)
