"""Summaries of many runs: made once from trained or stored runs, on any executor."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from builders import assert_same_numbers

from nmpcrl.analysis.summaries import SUMMARIES, fetch_summaries, make
from nmpcrl.analysis.summary import summarise
from nmpcrl.study import Experiment, fetch, lock, provenance, run, store, sweep
from nmpcrl.study.jobs import Failed

QUICK = Experiment("frozen", episodes=2, steps=3, evaluate_every=1)
THREE = sweep(learner="frozen", seed=(0, 1, 2), episodes=1, steps=2)


@pytest.fixture(autouse=True)
def folder(runs) -> Path:
    return runs / "summaries"


@pytest.fixture
def trained(monkeypatch) -> list[Experiment]:
    """The runs that are trained from here on."""
    found: list[Experiment] = []
    monkeypatch.setattr(store, "run", lambda e: (found.append(e), run(e))[1])
    return found


def here(experiments, **options):
    """The summaries, made in this process one after the other."""
    with ThreadPoolExecutor(1) as one:
        return fetch_summaries(experiments, executor=one, progress=False, **options)


def test_threads_of_one_process_make_what_one_makes(monkeypatch, tmp_path):
    """Torch's generator, from which networks are drawn, is one for the whole process."""
    networks = sweep(learner=("DES", "RDES"), seed=tuple(range(4)), episodes=3, steps=40)
    alone = here(networks)
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "again"))
    with ThreadPoolExecutor(4) as threads:
        together = fetch_summaries(networks, executor=threads, progress=False)
    for one in networks:
        assert_same_numbers(alone[one], together[one])


def test_a_stored_summary_is_read(folder, trained):
    found = here([QUICK])[QUICK]
    (path,) = folder.iterdir()
    assert path == SUMMARIES.path_of(QUICK)
    assert path.name.startswith("frozen-A-step-seed0-2ep-")
    assert_same_numbers(found, summarise(run(QUICK)))
    assert found.facts["key"] == provenance.key(QUICK)
    assert store.stored() == {}  # the run itself is not stored
    assert_same_numbers(here([QUICK, QUICK])[QUICK], found)
    assert_same_numbers(SUMMARIES.read(QUICK), found)
    assert trained == [QUICK]
    assert SUMMARIES.read(THREE[0]) is None


def test_a_stored_run_is_summarised_and_trained_only_afresh(trained, monkeypatch):
    records = fetch(QUICK)
    assert trained == [QUICK]
    then = lock.sources_hash()
    monkeypatch.setattr(lock, "locks", lambda: (then,))
    monkeypatch.setattr(lock, "sources_hash", lambda: "edited since")
    found = here([QUICK])[QUICK]
    assert_same_numbers(found, summarise(records))
    assert found.facts["seconds"] == records.facts["seconds"]
    assert found.facts["sources"] == then
    assert trained == [QUICK]
    assert_same_numbers(make(QUICK, afresh=True), found)
    assert trained == [QUICK, QUICK]


def test_a_run_that_fails_is_named_and_stops_no_other_one(monkeypatch, capsys):
    def fails(experiment):
        records = run(experiment)
        solver = "fatrop" if experiment.seed == 1 else "riccati"
        return replace(records, facts=records.facts | {"solver": solver})

    why = f"1 of 3 failed, {THREE[1]} because of Refusal: it is a run solved by fatrop and not by"
    monkeypatch.setattr(store, "run", fails)
    with pytest.raises(Failed, match=why):
        here(THREE)
    assert [SUMMARIES.path_of(e).exists() for e in THREE] == [True, False, True]
    assert list(here(THREE, strict=False)) == [THREE[0], THREE[2]]
    assert why in capsys.readouterr().err
