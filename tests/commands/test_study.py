"""`nmpcrl investigate main_study` and `verify`, on a study of six short runs."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
from builders import raising

from nmpcrl.analysis.summaries import SUMMARIES, fetch_summaries
from nmpcrl.claims import published
from nmpcrl.studies import main_study
from nmpcrl.study import design, store, sweep

SHORT = {"episodes": 4, "steps": 5, "evaluate_every": 2}
STUDY = {
    **dict.fromkeys(sweep(learner=("ES", "frozen"), seed=(0, 1), **SHORT), "main"),
    **dict.fromkeys(sweep(learner=("ES", "frozen"), horizon=5, **SHORT), "N = 5"),
}
SEARCHED = published.load().searches
STUDY_OF = ("investigate", "main_study")
CELL = ["variant", "learner", "layout", "decay", "seed"]


@pytest.fixture
def small(monkeypatch, timings, trains_here):
    """A study of six short runs, trained in this process, without searches and measured times."""
    times = timings
    monkeypatch.setattr(design, "whole_study", lambda: dict(STUDY))
    monkeypatch.setattr(main_study, "parallel", lambda *_: SEARCHED.items())
    monkeypatch.setattr(main_study, "time_learners_repeatedly", lambda: times)


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
        assert command(*STUDY_OF, "--publish").exit_code == 0
        shutil.copytree(tmp_path, ready, dirs_exist_ok=True)
    shutil.copytree(ready, tmp_path, dirs_exist_ok=True)
    return {e: SUMMARIES.read(e) for e in STUDY}


def done(command, *words, code=0):
    ended = command(*words)
    assert ended.exit_code == code, ended.output
    return ended.output


def test_study_says_what_is_missing_trains_a_part_and_then_the_rest(command, small, monkeypatch):
    assert "0 of 6 runs are stored" in done(command, *STUDY_OF, "--dry-run")
    done(command, *STUDY_OF, "--part", "N = 5", "--workers", "1")
    assert {STUDY[e] for e in STUDY if SUMMARIES.read(e)} == {"N = 5"}
    with monkeypatch.context() as patch:
        patch.setattr(store, "run", raising(ArithmeticError("a mistake")))
        said = done(command, *STUDY_OF, code=1)
    assert "4 of 6 failed" in said
    assert "ArithmeticError: a mistake" in said
    done(command, *STUDY_OF)
    assert "6 of 6 runs are stored" in done(command, *STUDY_OF, "--dry-run")


def test_verify_compares_with_the_published_runs_and_names_what_contradicts(
    command, published_here
):
    assert list(published.load().rows) == list(STUDY)
    assert [*published.load().searches] == [*SEARCHED]
    assert "6 bit for bit, 0 by distribution; contradictions: 0" in done(command, "verify")
    wrong = next(e for e in STUDY if e.learner == "ES")
    one = published_here[wrong]
    cost = one.evaluations["cost"].copy()
    cost[-1] += 1e-9
    replace(one, evaluations=one.evaluations | {"cost": cost}).save(SUMMARIES.path_of(wrong))
    said = done(command, "verify", code=1)
    assert "contradictions: 1\n" in said
    assert "final_cost" in said


@pytest.mark.parametrize("stored", [0, 5])
def test_verify_trains_as_many_runs_as_are_asked_for_besides_the_stored_ones(
    command, published_here, stored
):
    for experiment in list(STUDY)[stored:]:
        SUMMARIES.path_of(experiment).unlink()
    if not stored:
        assert "--sample 5 trains five for" in done(command, "verify", code=1)
    now = min(stored + 2, len(STUDY))
    assert f"{now} bit for bit, " in done(command, "verify", "--sample", "2")
    assert sum(SUMMARIES.path_of(e).exists() for e in STUDY) == now
    assert "sample = 7 must be a whole number from 0 to 6" in done(
        command, "verify", "--sample", "7", code=1
    )
