"""`nmpcrl study`, `verify` and `bench`, on a study of six short runs."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from raising import raising

from nmpcrl.analysis.summaries import SUMMARIES, fetch_summaries
from nmpcrl.bench.paired import Ratio
from nmpcrl.claims import publish, published, rule
from nmpcrl.claims.verdict import Verdict
from nmpcrl.study import design, limits, store, sweep

SHORT = {"episodes": 4, "steps": 5, "evaluate_every": 2}
STUDY = {
    **dict.fromkeys(sweep(learner=("ES", "frozen"), seed=(0, 1), **SHORT), "main"),
    **dict.fromkeys(sweep(learner=("ES", "frozen"), horizon=5, **SHORT), "N = 5"),
}
WHOLE = len(design.whole_study())
SEARCHED = published.load().searches


@pytest.fixture
def small(monkeypatch, measured, trains_here):
    """A study of six short runs, trained in this process, without searches and measured times."""
    times = pd.DataFrame(measured["learners"])
    monkeypatch.setattr(design, "whole_study", lambda: dict(STUDY))
    monkeypatch.setattr(publish, "search_all", lambda _: SEARCHED)
    monkeypatch.setattr(publish, "time_learners_repeatedly", lambda: times)


@pytest.fixture(scope="module")
def ready(tmp_path_factory):
    """A folder for the small study, trained and published once."""
    return tmp_path_factory.mktemp("ready")


@pytest.fixture
def published_here(command, small, ready, tmp_path):
    """The summaries of the small study, which is stored and published in a folder of this test."""
    if not any(ready.iterdir()):
        with ThreadPoolExecutor(1) as one:
            fetch_summaries(STUDY, executor=one, progress=False)
        assert command("study", "--publish").exit_code == 0
        shutil.copytree(tmp_path, ready, dirs_exist_ok=True)
    shutil.copytree(ready, tmp_path, dirs_exist_ok=True)
    return {e: SUMMARIES.read(e) for e in STUDY}


def test_a_dry_run_says_how_much_is_to_be_done_and_does_nothing(command, tmp_path):
    said = command("study", "--dry-run").output
    assert f"0 of {WHOLE:,} runs are stored" in said
    assert 1 < float(said.split("take about ")[1].split(" h of")[0]) < 24
    assert not (tmp_path / "runs").exists()


def test_study_trains_a_part_and_then_what_is_missing(command, small):
    asked = command("study", "--part", "N = 5", "--workers", "1")
    assert asked.exit_code == 0, asked.output
    assert {STUDY[e] for e in STUDY if SUMMARIES.is_stored(e)} == {"N = 5"}
    assert command("study").exit_code == 0
    assert "6 of 6 runs are stored" in command("study", "--dry-run").output


def test_a_run_that_fails_is_reported_and_the_others_are_stored(
    command, published_here, monkeypatch
):
    next(SUMMARIES.path_of(e) for e in STUDY if e.learner == "ES" and e.seed == 1).unlink()
    monkeypatch.setattr(store, "run", raising(ArithmeticError("a mistake")))
    ended = command("study")
    assert ended.exit_code == 1
    assert "1 of 6 failed" in ended.output
    assert "ArithmeticError: a mistake" in ended.output


def test_the_table_of_episodes_tells_every_run_from_every_other(command, published_here, tmp_path):
    asked = command("study", "--table", str(tmp_path / "episodes.csv.gz"))
    assert asked.exit_code == 0, asked.output
    frame = pd.read_csv(tmp_path / "episodes.csv.gz")
    assert len(frame) == len(STUDY) * SHORT["episodes"]
    names = ["variant", "learner", "layout", "decay", "seed"]
    assert not frame.duplicated([*names, "episode"]).any()
    runs = frame.set_index(names)
    for e, one in published_here.items():
        mine = runs.loc[(STUDY[e], e.learner, e.layout, e.decay, e.seed)]
        np.testing.assert_allclose(mine.cost, one.episodes["cost"], rtol=1e-6)


def test_verify_compares_with_the_published_runs_and_names_what_contradicts(
    command, published_here
):
    assert list(published.load().rows) == list(STUDY)
    assert [*published.load().searches] == [*SEARCHED]
    verified = command("verify")
    assert verified.exit_code == 0, verified.output
    assert "6 bit for bit, 0 by distribution; contradictions: 0" in verified.output
    wrong = next(e for e in STUDY if e.learner == "ES")
    one = published_here[wrong]
    cost = one.evaluations["cost"].copy()
    cost[-1] += 1e-9
    replace(one, evaluations=one.evaluations | {"cost": cost}).save(SUMMARIES.path_of(wrong))
    verified = command("verify")
    assert verified.exit_code == 1
    assert "contradictions: 1\n" in verified.output
    assert "final_cost" in verified.output


@pytest.mark.parametrize("stored", [0, 1, 5])
def test_verify_trains_as_many_runs_as_are_asked_for_besides_the_stored_ones(
    command, published_here, stored
):
    for experiment in list(STUDY)[stored:]:
        SUMMARIES.path_of(experiment).unlink()
    if not stored:
        assert "--sample 5 trains five for the comparison" in command("verify").output
    verified = command("verify", "--sample", "2")
    assert verified.exit_code == 0, verified.output
    now = min(stored + 2, len(STUDY))
    assert f"{now} bit for bit, " in verified.output
    assert sum(map(SUMMARIES.is_stored, STUDY)) == now


def test_verify_refuses_damaged_publications_and_too_large_samples(
    command, published_here, tmp_path
):
    said = command("verify", "--sample", "7").stderr
    assert "sample = 7 must be a whole number from 0 to 6" in said
    (tmp_path / "published/runs.npz").write_bytes(b"")
    for cache in (published._load, published.store._arrays):
        cache.cache_clear()
    refused = command("verify")
    assert refused.exit_code == 1
    assert "is not the file that was published" in refused.output


def test_a_study_without_numba_is_refused(command, published_here, monkeypatch):
    SUMMARIES.path_of(next(iter(STUDY))).unlink()
    monkeypatch.setattr(limits, "environment", lambda: {"numba": "absent"})
    refused = command("study")
    assert refused.exit_code == 1
    assert "Refusal: numba is not installed, and without it riccati" in refused.output


@pytest.mark.parametrize(("outcome", "code"), [(rule.PARTLY, 0), (rule.UNDECIDABLE, 1)])
def test_bench_publishes_the_verdicts_on_time_only_where_they_are_decided(
    command, monkeypatch, outcome, code
):
    ratio = Ratio(0.65, 0.62, 0.68, 0.1)
    judged = Verdict("C3", "half the time", outcome, numbers={"ipopt": ratio})
    monkeypatch.setattr(publish, "publish_timing", lambda: (judged,))
    done = command("bench", "--publish")
    assert done.exit_code == code
    assert "0.65 [0.62, 0.68] with ipopt" in done.output
    assert ("nothing is published" in done.output) == bool(code)


def test_bench_sweeps_over_as_many_problems_as_asked_for(command, monkeypatch):
    from nmpcrl.bench import sweep

    asked = []
    monkeypatch.setattr(sweep, "sweep", lambda problems: asked.append(problems) or "a table")
    for words in (("--sweep",), ("--sweep", "20")):
        assert command("bench", *words).output == f"a table\n{sweep.path()}: stored\n"
    assert asked == [100_000, 20]
