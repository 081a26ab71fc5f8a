"""Locking the code anew: only where fresh runs have the bits that the code of the lock made."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from nmpcrl.analysis import summaries
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.claims import published, verification
from nmpcrl.claims.published import Published
from nmpcrl.claims.verification import CannotRelock, relock, sample
from nmpcrl.study import provenance, sweep
from nmpcrl.study.storage.executor import THREADS

SHORT = {"episodes": 2, "steps": 3, "evaluate_every": 1}
MAIN = sweep(learner=("ES", "GES"), seed=(0, 1, 2), **SHORT)
OTHER = sweep(learner="ES", horizon=5, seed=(0, 1), **SHORT)
PARTS = dict.fromkeys(MAIN, "main") | dict.fromkeys(OTHER, "N = 5")


@pytest.fixture(autouse=True)
def lock(tmp_path, monkeypatch):
    """Runs and a lock of this test's own; the lock is of the code as it is."""
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "published"))
    for name in THREADS:
        monkeypatch.setenv(name, "1")
    monkeypatch.setattr(provenance, "LOCK", tmp_path / "sources.lock.json")
    return provenance.relock()


@pytest.fixture
def known() -> Published:
    """What another machine has published."""
    return Published(variants=PARTS, rows={})


@pytest.fixture
def edited(monkeypatch):
    """From here on the code is another, whose runs have these facts changed."""

    def edit(**facts):
        real = summaries.summarise
        monkeypatch.setattr(provenance, "sources", lambda: {"learning/updates.py": "edited"})
        monkeypatch.setattr(provenance, "sources_hash", lambda: "edited")

        def changed(records):
            one = real(records)
            evaluations = one.evaluations | {"cost": one.evaluations["cost"] * facts["times"]}
            return replace(one, evaluations=evaluations)

        if facts:
            monkeypatch.setattr(summaries, "summarise", changed)

    return edit


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch):
    """Train here: what is patched does not reach other processes."""

    def execute(jobs, keep, **_):
        for name, job in jobs.items():
            keep(name, job())
        return {}

    monkeypatch.setattr(verification, "execute", execute)


def train_here(experiments):
    with ThreadPoolExecutor(1) as executor:
        fetch_summaries(experiments, executor=executor, progress=False)


def test_a_sample_is_spread_over_parts_and_learners(known):
    assert sample(known, 2) == (MAIN[0], OTHER[0])
    four = sample(known, 4)
    assert {PARTS[e] for e in four[:2]} == {PARTS[e] for e in four[2:]} == {"main", "N = 5"}
    assert {e.learner for e in four if PARTS[e] == "main"} == {"ES", "GES"}
    assert set(sample(known, 99)) == set(PARTS)


def test_a_sample_of_the_published_study_has_every_part():
    real = published._load(provenance.ROOT.parent / "book" / "published")
    drawn = sample(real, 60)
    assert len(set(drawn)) == 60
    assert {real.variants[e] for e in drawn} == set(real.variants.values())


def test_the_lock_is_written_where_no_bit_has_changed(known, lock, edited):
    train_here(sample(known, 4))
    edited()
    done = relock(known, 4)
    assert (done.published, done.stored) == (0, 4)
    assert json.loads(lock.read_text())["sources"] == {"learning/updates.py": "edited"}
    for experiment in sample(known, 4):  # the next edit is compared with these
        assert summaries.load(experiment).facts["sources"] == "edited"


def test_a_changed_bit_leaves_the_lock_and_is_named(known, lock, edited):
    before = lock.read_text()
    train_here(sample(known, 4))
    edited(times=1 + 1e-15)
    with pytest.raises(CannotRelock, match=r"4 of 4 runs have other bits, first ES .*final_cost"):
        relock(known, 4)
    assert lock.read_text() == before


def test_without_anything_to_compare_with_the_lock_stays(known, lock, edited):
    before = lock.read_text()
    edited()
    with pytest.raises(CannotRelock, match=r"only 0 of 4 runs .* `nmpcrl verify --sample 4`"):
        relock(known, 4)
    assert lock.read_text() == before


def test_what_other_code_than_the_locks_made_is_nothing_to_compare_with(known, edited):
    edited()
    train_here(sample(known, 4))
    with pytest.raises(CannotRelock, match="only 0 of 4"):
        relock(known, 4)
