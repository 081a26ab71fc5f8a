"""The store: which runs are read, which are trained again, and what is refused in one sentence."""

import errno
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from raising import raising

from nmpcrl.control import Nmpc
from nmpcrl.control.solvers import Fatrop
from nmpcrl.learning import learners
from nmpcrl.study import (
    DamagedRecords,
    Experiment,
    Records,
    Runs,
    StoreError,
    fetch,
    fetch_all,
    files,
    lock,
    provenance,
    run,
    store,
    stored,
    sweep,
)
from nmpcrl.study.jobs import Failed
from nmpcrl.study.store import RUNS, check_folder, is_stored, path_of

QUICK = Experiment(learner="frozen", episodes=1, steps=3)
LEARNING = Experiment(learner="ES", episodes=1, steps=3)
CLOCKS = {"seconds", "solve_seconds", "fit_seconds"}

pytestmark = pytest.mark.usefixtures("runs", "unwarned")


@pytest.fixture
def unwarned(monkeypatch) -> None:
    monkeypatch.setenv("NMPCRL_WARNED", "1")


@pytest.fixture
def no_run(monkeypatch) -> Callable[[], None]:
    """From the call on, training is a mistake."""
    mistake = raising(AssertionError("a stored run was trained again"))
    return lambda: monkeypatch.setattr(store, "run", mistake)


def here(*experiments: Experiment) -> Runs[Records]:
    with ThreadPoolExecutor(2) as threads:
        return fetch_all(experiments, executor=threads, progress=False)


def assert_same_numbers(one: Records, other: Records) -> None:
    for name in set(one.steps) - CLOCKS:
        np.testing.assert_array_equal(one.steps[name], other.steps[name])


def test_a_stored_run_is_read_and_says_what_it_depends_on(runs, no_run):
    records = fetch(QUICK)
    assert [*runs.glob("*.npz")] == [path_of(QUICK)] == [*stored()]
    assert path_of(QUICK).name.startswith("frozen-A-step-seed0-1ep-")
    facts = Records.load(path_of(QUICK)).facts
    assert facts == records.facts
    assert facts["key"] == provenance.key(QUICK)
    assert facts["sources"] == lock.sources_hash()
    assert facts["versions"] == provenance.environment()
    no_run()
    assert_same_numbers(fetch(QUICK), records)
    assert_same_numbers(here(QUICK, QUICK)[QUICK], records)


def test_a_file_of_the_first_edition_is_read(no_run):
    """It has a checksum, a field `plant`, and no field that became one later."""
    records, path = fetch(LEARNING), path_of(LEARNING)
    fields = {**records.experiment, "plant": "model"}
    del fields["tolerance"]
    replace(records, experiment=fields).save(path)
    with np.load(path) as file:
        members = {**file, "checksum": np.array("0" * 64)}
    assert set(members) == {"about", "checksum"} | {
        *(f"steps/{name}" for name in records.steps),
        *(f"evaluations/{name}" for name in records.evaluations),
    }
    np.savez_compressed(path, **members)
    no_run()
    assert is_stored(LEARNING)
    assert_same_numbers(fetch(LEARNING), records)
    assert_same_numbers(here(LEARNING)[LEARNING], records)


def of_edited_code(monkeypatch) -> Records:
    """A stored run in which every step of learning was three times as large."""
    step = learners.semi_gradient_step
    with monkeypatch.context() as edited:
        edited.setattr(lock, "sources_hash", lambda: "of an edit")
        edited.setattr(
            learners, "semi_gradient_step", lambda theta, by, *rest: step(theta, 3 * by, *rest)
        )
        return fetch(LEARNING)


def test_a_run_of_edited_code_is_trained_again_when_the_edit_is_reverted(monkeypatch, capsys):
    honest, wrong = run(LEARNING), of_edited_code(monkeypatch)
    assert not np.array_equal(wrong.steps["theta"], honest.steps["theta"])
    assert not is_stored(LEARNING)
    assert_same_numbers(fetch(LEARNING), honest)
    assert "holds a run of code that is neither this nor locked" in capsys.readouterr().err
    path_of(LEARNING).unlink()
    of_edited_code(monkeypatch)
    assert_same_numbers(here(LEARNING)[LEARNING], honest)


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


def of_another(experiment: Experiment) -> Callable[[Path], object]:
    def damage(path: Path) -> None:
        fetch(experiment)
        path.write_bytes(path_of(experiment).read_bytes())

    return damage


def of_other_versions(path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(provenance, "installed", lambda _: "0.0.1")
        fetch(QUICK)
        other = path_of(QUICK)
    other.replace(path)


def of_another_solver(path: Path) -> None:
    records = Records.load(path)
    replace(records, facts=records.facts | {"solver": "fatrop"}).save(path)


def changed(**members: np.ndarray | None) -> Callable[[Path], object]:
    def damage(path: Path) -> None:
        with np.load(path) as file:
            kept = {**file, **{name.replace("_", "/"): value for name, value in members.items()}}
        np.savez_compressed(path, **{k: v for k, v in kept.items() if v is not None})

    return damage


DAMAGES = {
    "cut": lambda path: path.write_bytes(path.read_bytes()[:-200]),
    "empty": lambda path: path.write_bytes(b""),
    "a column of another length": changed(steps_cost=np.zeros(2)),
    "a column missing": changed(steps_cost=None),
    "no facts": changed(about=np.array("{}")),
    "facts that are no JSON": changed(about=np.array("{")),
    "another seed": of_another(replace(QUICK, seed=1)),
    "another learner": of_another(LEARNING),
    "another layout": of_another(replace(QUICK, layout="B")),
    "another tolerance": of_another(replace(QUICK, tolerance=1e-7)),
    "other versions": of_other_versions,
    "another solver": of_another_solver,
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_file_that_is_not_the_run_is_set_aside_and_the_run_trained_again(damage, capsys):
    path, honest = path_of(QUICK), fetch(QUICK)
    for ask in (fetch, lambda one: here(one)[one]):
        damage(path)
        assert_same_numbers(ask(QUICK), honest)
        told = capsys.readouterr().err
        assert told.startswith(str(path))
        assert told.endswith(f"it is now {path.stem}.damaged, and the run is made again\n")
        assert path.with_suffix(".damaged").exists()


def test_no_flipped_byte_changes_a_number():
    honest, path = fetch(LEARNING), path_of(LEARNING)
    content = path.read_bytes()
    for place in np.random.default_rng(0).integers(0, len(content), 300):
        flipped = bytearray(content)
        flipped[place] ^= 1 << int(place) % 8
        path.write_bytes(flipped)
        try:
            found = store.read(LEARNING)
        except DamagedRecords:
            continue
        assert found.facts == honest.facts
        for name, column in honest.steps.items():
            np.testing.assert_array_equal(found.steps[name], column)


@pytest.mark.parametrize("ask", [fetch, lambda one: here(one)[one]], ids=["fetch", "fetch_all"])
def test_a_run_that_another_solver_had_to_solve_is_returned_and_not_stored(
    monkeypatch, capsys, ask
):
    def run_by_another(experiment, **options):
        records = run(experiment, **options)
        return replace(records, facts=records.facts | {"solver": "fatrop"})

    monkeypatch.setattr(store, "run", run_by_another)
    assert ask(QUICK).facts["solver"] == "fatrop"
    told = f"{QUICK} is not stored: it was solved by fatrop and not by riccati\n"
    assert capsys.readouterr().err == told
    assert not path_of(QUICK).exists()


def test_a_run_says_if_any_of_its_problems_needed_another_solver(monkeypatch):
    """Q(s, a) is another problem than V(s): one may compile and the other not."""
    prepared = Nmpc._prepared

    def not_with_a_fixed_action(nmpc, ocp):
        if ocp.fixed_action.size:
            nmpc._solves = Fatrop(nmpc.solver.tolerance)
        return prepared(nmpc, ocp)

    monkeypatch.setattr(Nmpc, "_prepared", not_with_a_fixed_action)
    assert run(replace(QUICK, learner="QL")).facts["solver"] == "fatrop"
    assert run(QUICK).facts["solver"] == "riccati"


def test_other_files_are_not_listed(runs, capsys):
    assert stored() == {}
    fetch(QUICK)
    (runs / "other.npz").write_bytes(b"not a run")
    (runs / "notes.txt").write_text("not even that")
    assert [*stored()] == [path_of(QUICK)]
    assert capsys.readouterr().err.endswith("other.npz is damaged, or not a run; it is ignored\n")


@pytest.mark.slow
def test_runs_train_in_processes_and_come_out_as_in_this_one():
    experiments = sweep(learner=("RDES", "GES"), episodes=2, steps=65)
    found = fetch_all(experiments, workers=2, progress=False)
    assert [*found] == [*experiments]
    for experiment in experiments:
        assert_same_numbers(found[experiment], run(experiment))
        assert_same_numbers(Records.load(path_of(experiment)), found[experiment])


def test_one_failing_run_does_not_keep_the_others_from_being_stored(monkeypatch):
    experiments = sweep(learner="frozen", seed=[0, 1, 2], episodes=1, steps=2)

    def run_but_one(experiment):
        if experiment.seed == 1:
            raise ArithmeticError("a mistake")
        return run(experiment)

    monkeypatch.setattr(store, "run", run_but_one)
    with pytest.raises(Failed, match=r"1 of 3 failed, .*seed 1.* ArithmeticError: a mistake"):
        here(*experiments)
    assert [fields["seed"] for fields, _ in stored().values()] == [0, 2]


def a_file(place: Path, _: pytest.MonkeyPatch) -> None:
    place.write_text("")


def below_a_file(place: Path, patch: pytest.MonkeyPatch) -> None:
    place.write_text("")
    patch.setenv("NMPCRL_RUNS", str(place / "deeper"))


def read_only(_: Path, patch: pytest.MonkeyPatch) -> None:
    error = OSError(errno.EROFS, "Read-only file system")
    patch.setattr(files.tempfile, "TemporaryFile", raising(error))


def small(_: Path, patch: pytest.MonkeyPatch) -> None:
    usage = type("Usage", (), {"free": 1000})
    patch.setattr(files.shutil, "disk_usage", lambda _: usage)


REFUSALS = {
    a_file: r"(cannot be written \(File exists\)|Not a directory)",
    below_a_file: r"(cannot be written \(Not a directory\)|Not a directory)",
    read_only: r"cannot be written \(Read-only file system\): correct that, or set NMPCRL_RUNS",
    small: r"has 0.00 MB of free space and needs 0.02 MB",
}


@pytest.mark.parametrize(("spoil", "told"), REFUSALS.items())
@pytest.mark.parametrize("ask", [fetch, here, lambda _: check_folder(20_000)])
def test_a_folder_that_is_none_is_refused_before_anything_is_trained(
    runs, monkeypatch, no_run, spoil, told, ask
):
    no_run()
    spoil(runs, monkeypatch)
    with pytest.raises((StoreError, NotADirectoryError), match=told) as raised:
        ask(QUICK)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("ask", [fetch, here])
def test_a_disk_that_is_full_when_a_run_ends_is_one_sentence(runs, monkeypatch, ask):
    fetch(LEARNING)

    def full(file, **_):
        file.write(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full)
    with pytest.raises(StoreError, match=r"npz cannot be written \(No space left on device\)"):
        ask(QUICK)
    assert [*runs.glob("*.npz")] == [path_of(LEARNING)]
    assert [*runs.glob(".*.tmp")] == []


def test_a_run_that_may_not_be_read_is_not_taken_for_a_damaged_one(monkeypatch, no_run):
    fetch(QUICK)
    content = path_of(QUICK).read_bytes()
    no_run()
    denied = PermissionError(errno.EACCES, "Permission denied", str(path_of(QUICK)))
    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", raising(denied))
        for ask in (fetch, here):
            with pytest.raises(PermissionError):
                ask(QUICK)
    assert path_of(QUICK).read_bytes() == content


@pytest.mark.parametrize("ask", [fetch, lambda one: here(one)[one]], ids=["fetch", "fetch_all"])
def test_a_run_that_another_is_training_is_awaited_and_not_trained_twice(monkeypatch, ask):
    trained, told = list[Experiment](), list[str]()
    begun, waiting, go_on = (threading.Event() for _ in range(3))
    monkeypatch.setattr(store, "say", lambda sentence: (told.append(sentence), waiting.set()))

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
        assert "being trained by another process" in "".join(told)
        go_on.set()
        assert_same_numbers(first.result(), second.result())
    assert trained == [QUICK]


HOLDER = """
import time
from nmpcrl.study import Experiment
from nmpcrl.study.store import RUNS
with RUNS.lock(Experiment(learner="frozen", episodes=1, steps=3)):
    print("locked", flush=True)
    time.sleep(600)
"""


@pytest.mark.slow
def test_the_run_of_a_killed_process_is_free():
    with subprocess.Popen([sys.executable, "-c", HOLDER], stdout=subprocess.PIPE) as holder:
        assert holder.stdout
        assert holder.stdout.readline() == b"locked\n"
        threading.Timer(1.0, os.kill, (holder.pid, signal.SIGKILL)).start()
        assert fetch(QUICK).facts["stopped"] == "finished"
    with RUNS.lock(QUICK).acquire(timeout=0):
        pass


def test_runs_are_read_by_experiment_and_selected_by_field():
    experiments = sweep(learner=("ES", "frozen"), seed=(5, 6), episodes=1)
    study = Runs(dict(zip(experiments, "abcd", strict=True)))
    assert len(study) == 4
    assert study[experiments[2]] == "c"
    assert list(study.select(seed=6).values()) == ["b", "d"]
    assert list(study.select(seed=6, learner="ES")) == [experiments[1]]
    assert len(study.select(seed=7)) == 0
    assert study.values_of("learner") == ("ES", "frozen")
    assert study.values_of("seed") == (5, 6)
