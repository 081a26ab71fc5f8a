"""The store: runs that are read, runs that are trained again, and refusals in one sentence."""

import errno
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from builders import assert_same_numbers, raising

from nmpcrl.control import Nmpc
from nmpcrl.control.solvers import Fatrop
from nmpcrl.control.variant import Variant
from nmpcrl.study import (
    Experiment,
    Records,
    StoreError,
    fetch,
    fetch_all,
    files,
    lock,
    provenance,
    run,
    store,
    stored,
)
from nmpcrl.study.store import RUNS

QUICK = Experiment(learner="frozen", episodes=1, steps=3)
LEARNING = Experiment(learner="ES", episodes=1, steps=3)

pytestmark = pytest.mark.usefixtures("runs", "unwarned")


@pytest.fixture
def unwarned(monkeypatch) -> None:
    monkeypatch.setenv("NMPCRL_WARNED", "1")


@pytest.fixture
def no_run(monkeypatch) -> Callable[[], None]:
    """From the call on, training fails."""
    return lambda: monkeypatch.setattr(store, "run", raising(AssertionError("trained")))


def one_of_all(experiment: Experiment) -> Records:
    with ThreadPoolExecutor(2) as threads:
        return fetch_all([experiment], executor=threads, progress=False)[experiment]


both_ways = pytest.mark.parametrize("ask", [fetch, one_of_all])


def test_a_stored_run_is_read_and_says_what_it_depends_on(runs, no_run):
    records, path = fetch(QUICK), RUNS.path_of(QUICK)
    assert [*runs.glob("*.npz")] == [path] == [*stored()]
    assert path.name.startswith("frozen-A-step-seed0-1ep-")
    facts = Records.load(path).facts
    assert facts == records.facts
    assert facts["key"] == provenance.key(QUICK)
    assert facts["sources"] == lock.sources_hash()
    assert facts["versions"] == provenance.environment()
    no_run()
    for ask in (fetch, one_of_all):
        assert_same_numbers(ask(QUICK), records)


def test_a_file_that_was_written_before_a_field_and_with_another_member_is_read(no_run):
    records, path = fetch(LEARNING), RUNS.path_of(LEARNING)
    fields = {name: one for name, one in records.experiment.items() if name != "tolerance"}
    replace(records, experiment=fields).save(path)
    with np.load(path) as file:
        members = {**file, "checksum": np.array("0" * 64)}
    np.savez_compressed(path, **members)
    no_run()
    for ask in (fetch, one_of_all):
        assert_same_numbers(ask(LEARNING), records)


def test_a_run_of_code_that_the_lock_has_or_had_is_read(monkeypatch, no_run, tmp_path):
    monkeypatch.setattr(lock, "LOCK", tmp_path / "sources.lock.json")
    records = fetch(QUICK)
    lock.relock()
    no_run()
    for edit in ("one", "another"):
        monkeypatch.setattr(lock, "sources", lambda edit=edit: {"run.py": edit})
        monkeypatch.setattr(lock, "sources_hash", lambda edit=edit: provenance.hash_of([edit]))
        lock.relock()
        assert_same_numbers(fetch(QUICK), records)
    monkeypatch.setitem(provenance.EPOCHS, "study", 2)
    lock.relock()
    assert not lock.is_accepted(records.facts["sources"])


OTHER = [{"key": "0"}, {"sources": "0"}, {"solver": "fatrop"}]  # versions, code, solver


@both_ways
@pytest.mark.parametrize("other", OTHER, ids=str)
def test_where_a_file_is_not_the_run_the_run_is_trained_again(other, ask, capsys):
    path, honest = RUNS.path_of(QUICK), fetch(QUICK)
    replace(honest, facts=honest.facts | other).save(path)
    assert not RUNS.read(QUICK)
    assert_same_numbers(ask(QUICK), honest)
    assert capsys.readouterr().err.startswith(f"{path} ")
    assert RUNS.read(QUICK)


@both_ways
@pytest.mark.parametrize("other", OTHER, ids=str)
def test_a_run_of_a_worker_with_other_code_or_another_solver_is_not_stored(
    monkeypatch, capsys, ask, other
):
    make = RUNS.make
    monkeypatch.setattr(
        RUNS, "make", lambda one: replace(made := make(one), facts=made.facts | other)
    )
    if "solver" in other:  # it is returned
        assert ask(QUICK).facts["solver"] == "fatrop"
        assert "a run solved by fatrop and not by riccati" in capsys.readouterr().err
    else:
        with pytest.raises(StoreError, match="is not stored: the worker made a"):
            ask(QUICK)
    assert not RUNS.path_of(QUICK).exists()


def test_a_run_says_if_any_of_its_problems_needed_another_solver(monkeypatch):
    """Q(s, a) is another problem than V(s): one may compile and the other not."""
    made = Nmpc._with

    def not_with_a_fixed_action(nmpc, *, fix_action):
        variant = made(nmpc, fix_action=fix_action)
        return Variant(variant.ocp, Fatrop()) if fix_action else variant

    monkeypatch.setattr(Nmpc, "_with", not_with_a_fixed_action)
    assert run(replace(QUICK, learner="QL")).facts["solver"] == "fatrop"
    assert run(QUICK).facts["solver"] == "riccati"


@both_ways
def test_a_folder_that_cannot_be_written_is_refused_before_anything_is_trained(
    monkeypatch, no_run, ask
):
    no_run()
    error = OSError(errno.EROFS, "Read-only file system")
    monkeypatch.setattr(files.tempfile, "TemporaryFile", raising(error))
    with pytest.raises(StoreError, match=r"cannot be written \(Read-only .* set NMPCRL_RUNS"):
        ask(QUICK)


@both_ways
def test_a_run_that_another_is_training_is_awaited_and_not_trained_twice(monkeypatch, ask):
    trained, said = list[Experiment](), list[str]()
    begun, waiting, go_on = (threading.Event() for _ in range(3))
    monkeypatch.setattr(files, "say", lambda sentence: (said.append(sentence), waiting.set()))

    def slowly(experiment, **_):
        trained.append(experiment)
        begun.set()
        assert go_on.wait(60)
        return run(experiment)

    monkeypatch.setattr(store, "run", slowly)
    with ThreadPoolExecutor(2) as threads:
        first = threads.submit(fetch, QUICK)
        assert begun.wait(60)
        second = threads.submit(ask, QUICK)
        waiting.wait(60)
        assert "another process is making" in "".join(said)
        go_on.set()
        assert_same_numbers(first.result(), second.result())
    assert trained == [QUICK]
