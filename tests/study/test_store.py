"""The store: whole files or none, reuse of what would come out the same, and killed workers."""

import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from raising import raising

from nmpcrl.control import Nmpc
from nmpcrl.control.solvers import Fatrop
from nmpcrl.learning import learners
from nmpcrl.study import (
    Experiment,
    Records,
    Runs,
    fetch,
    fetch_all,
    provenance,
    run,
    store,
    stored,
    sweep,
)
from nmpcrl.study.provenance import key
from nmpcrl.study.records import Stopped
from nmpcrl.study.storage.executor import ATTEMPTS, Killed
from nmpcrl.study.storage.machine import fingerprint
from nmpcrl.study.store import folder, is_stored, name_of, path_of

QUICK = Experiment(learner="frozen", episodes=1, steps=3)
LEARNING = Experiment(learner="ES", episodes=1, steps=3)
CLOCKS = {"seconds", "solve_seconds", "fit_seconds"}

pytestmark = pytest.mark.usefixtures("runs")


@pytest.fixture
def no_run(monkeypatch):
    """From here on, training is a mistake."""

    return lambda: monkeypatch.setattr(
        store, "run", raising(AssertionError("a stored run was trained again"))
    )


def files(folder: Path) -> list[Path]:
    """All but what is hidden."""
    return sorted(path for path in folder.iterdir() if not path.name.startswith("."))


def assert_same_numbers(one, other):
    for name in set(one.steps) - CLOCKS:
        np.testing.assert_array_equal(one.steps[name], other.steps[name])


def test_a_run_is_stored_under_its_experiment(runs):
    records = fetch(QUICK)
    assert files(runs) == [path_of(QUICK)]
    assert folder() == runs
    assert path_of(QUICK).name.startswith("frozen-A-step-seed0-1ep-")
    assert_same_numbers(Records.load(path_of(QUICK)), records)


def test_a_stored_run_is_read_not_trained(no_run):
    records = fetch(QUICK)
    no_run()
    assert_same_numbers(fetch(QUICK), records)
    assert_same_numbers(fetch_all([QUICK], progress=False)[QUICK], records)


def test_what_is_stored_says_what_it_depends_on():
    records = fetch(QUICK)
    facts = Records.load(path_of(QUICK)).facts
    assert facts == records.facts
    assert facts["key"] == key(QUICK)
    assert facts["stopped"] == Stopped.FINISHED
    assert set(facts["versions"]) == {"python", "casadi", "numba", "numpy", "torch"}
    assert facts["sources"] == provenance.sources_hash()
    assert facts["machine"] == fingerprint()


def test_a_run_of_other_versions_is_not_reused(monkeypatch, no_run):
    fetch(QUICK)
    monkeypatch.setattr(provenance, "installed", lambda library: "0.0.1")
    no_run()
    with pytest.raises(AssertionError, match="trained again"):
        fetch(QUICK)


def of_edited_code(monkeypatch) -> Records:
    """A run that is stored, in which every step of learning was three times as large."""
    step = learners.semi_gradient_step
    with monkeypatch.context() as edited:
        edited.setattr(provenance, "sources_hash", lambda: "of an edit")
        edited.setattr(
            learners,
            "semi_gradient_step",
            lambda theta, delta, *rest: step(theta, 3 * delta, *rest),
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
    assert_same_numbers(fetch_all([LEARNING], progress=False)[LEARNING], honest)


def test_a_run_of_code_that_the_lock_has_or_had_is_read(monkeypatch, no_run, tmp_path):
    monkeypatch.setattr(provenance, "LOCK", tmp_path / "sources.lock.json")
    records = fetch(QUICK)
    provenance.relock()
    no_run()
    for edit in ("one", "another"):
        monkeypatch.setattr(provenance, "sources", lambda edit=edit: {"run.py": edit})
        monkeypatch.setattr(
            provenance, "sources_hash", lambda edit=edit: provenance.hash_of([edit])
        )
        provenance.relock()
        assert_same_numbers(fetch(QUICK), records)
    monkeypatch.setitem(provenance.EPOCHS, "study", 2)
    provenance.relock()
    assert not provenance.is_accepted(records.facts["sources"])


def test_a_damaged_file_is_set_aside_and_the_run_done_again(runs, capsys):
    records, path = fetch(QUICK), path_of(QUICK)
    path.write_bytes(path.read_bytes()[:-200])
    assert_same_numbers(fetch(QUICK), records)
    assert [p.suffix for p in files(runs)] == [".damaged", ".npz"]
    assert "is kept as" in capsys.readouterr().err


OTHERS = {
    "another seed": replace(QUICK, seed=1),
    "another learner": replace(QUICK, learner="ES"),
    "another step size": replace(QUICK, learner="ES", alpha=1e-9),
    "another layout": replace(QUICK, layout="B"),
    "another tolerance": replace(QUICK, tolerance=1e-7),
}


def copied(experiment: Experiment, to: Experiment) -> None:
    """The run of an experiment, under the name of another."""
    fetch(experiment)
    shutil.copy(path_of(experiment), path_of(to))


@pytest.mark.parametrize("other", OTHERS.values(), ids=OTHERS)
def test_the_run_of_another_experiment_is_never_returned(runs, capsys, other):
    copied(other, QUICK)
    assert not store.is_stored(QUICK)
    with ThreadPoolExecutor(1) as executor:
        assert_same_numbers(fetch_all([QUICK], executor=executor, progress=False)[QUICK], fresh())
    said = f"{path_of(QUICK)} holds another run, {name_of(other)}; it is kept as"
    assert said in capsys.readouterr().err
    copied(other, QUICK)
    assert_same_numbers(fetch(QUICK), fresh())
    assert said in capsys.readouterr().err
    assert len(list(runs.glob("*.damaged*"))) == 2  # and neither is written over


def fresh() -> Records:
    return run(QUICK)


def test_a_run_that_lies_under_the_name_of_another_is_listed_under_none(runs, capsys):
    copied(OTHERS["another learner"], QUICK)
    (runs / "a-name-of-my-own.npz").write_bytes(path_of(QUICK).read_bytes())
    kept = (path_of(OTHERS["another learner"]), runs / "a-name-of-my-own.npz")
    assert sorted(stored()) == sorted(kept)
    said = capsys.readouterr().err
    assert f"{path_of(QUICK)} holds another run, ES-A-step-seed0-1ep-" in said
    assert "; it is ignored" in said


def test_a_run_of_other_versions_under_this_name_is_damaged(runs, monkeypatch, capsys):
    with monkeypatch.context() as patch:
        patch.setattr(provenance, "installed", lambda library: "0.0.1")
        fetch(QUICK)
        (path,) = runs.glob("*.npz")
    path.rename(path_of(QUICK))
    fetch(QUICK)
    assert "of other code or other versions than it says; it is kept" in capsys.readouterr().err


def test_a_run_of_before_a_field_was_made_is_the_run_asked_for(no_run):
    """It lacks a field whose default may have changed since; `ORIGINAL` has what it was."""
    records = fetch(QUICK)
    del records.experiment["tolerance"]
    records.save(path_of(QUICK))
    no_run()
    fetch(QUICK)


def test_what_is_damaged_inside_is_noticed_late_and_made_again(capsys):
    """Its name, its columns and what it is about are right; only its numbers are not."""
    records = fetch(QUICK)
    with np.load(path_of(QUICK)) as file:
        members = dict(file)
    members["steps/cost"] = members["steps/cost"] + 1.0
    np.savez_compressed(path_of(QUICK), **members)
    assert store.is_stored(QUICK)
    assert_same_numbers(fetch_all([QUICK], progress=False)[QUICK], records)
    assert "its content is not what its checksum says; it is kept" in capsys.readouterr().err
    assert_same_numbers(Records.load(path_of(QUICK)), records)


@pytest.fixture
def by_fatrop(monkeypatch):
    """Training says that it needed another solver."""

    def run_by_another(experiment, **options):
        records = run(experiment, **options)
        return replace(records, facts=records.facts | {"solver": "fatrop"})

    monkeypatch.setattr(store, "run", run_by_another)


@pytest.mark.parametrize("many", [False, True])
def test_a_run_that_another_solver_had_to_solve_is_returned_and_not_stored(
    runs, by_fatrop, capsys, many
):
    with ThreadPoolExecutor(1) as executor:
        options = {"executor": executor, "progress": False}
        found = fetch_all([QUICK], **options)[QUICK] if many else fetch(QUICK)
    assert found.facts["solver"] == "fatrop"
    said = f"{QUICK} is not stored: it was solved by fatrop and not by riccati\n"
    assert capsys.readouterr().err == said  # once: it is not trained again, either
    assert files(runs) == []


def test_a_run_that_another_solver_solved_and_that_was_stored_is_made_again(capsys):
    records = fetch(QUICK)
    replace(records, facts=records.facts | {"solver": "fatrop"}).save(path_of(QUICK))
    assert fetch(QUICK).facts["solver"] == "riccati"
    assert "holds a run solved by fatrop and not by riccati; it is" in capsys.readouterr().err


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


def test_what_is_stored_is_listed(runs):
    experiments = sweep(learner="frozen", seed=[0, 1], episodes=1, steps=2)
    for e in experiments:
        fetch(e)
    (runs / "other.npz").write_bytes(b"not a run")
    (runs / "notes.txt").write_text("not even that")
    listed = stored()
    assert set(listed) == {path_of(e) for e in experiments}
    assert [fields["seed"] for fields, _ in listed.values()] == [0, 1]


def test_without_a_folder_nothing_is_stored():
    assert stored() == {}


KILLED = """
import os, signal
import numpy as np
from nmpcrl.study import Experiment, fetch

def write_half(file, **arrays):
    file.write(b"PK" + bytes(1000))
    file.flush()
    os.kill(os.getpid(), signal.SIGKILL)

np.savez_compressed = write_half
fetch(Experiment(learner="frozen", episodes=1, steps=3))
"""


@pytest.mark.slow
def test_a_run_killed_while_it_is_written_leaves_no_half_file(runs, capsys):
    killed = subprocess.run([sys.executable, "-c", KILLED], check=False, timeout=120)
    assert killed.returncode == -signal.SIGKILL
    assert list(runs.glob("*.npz")) == []
    assert stored() == {}
    assert capsys.readouterr().err == ""
    assert fetch(QUICK).facts["stopped"] == "finished"
    assert list(stored()) == [path_of(QUICK)]


@pytest.mark.slow
def test_runs_train_in_processes_and_come_out_as_in_this_one():
    experiments = sweep(learner=("RDES", "GES"), episodes=2, steps=65)
    study = fetch_all(experiments, workers=2, progress=False)
    assert list(study) == list(experiments)
    for experiment in experiments:
        assert_same_numbers(study[experiment], run(experiment))


def test_any_executor_will_do():
    experiments = sweep(learner=("ES", "frozen"), episodes=1, steps=3)
    with ThreadPoolExecutor(2) as executor:
        study = fetch_all(experiments, executor=executor, progress=False)
    for experiment in experiments:
        assert_same_numbers(study[experiment], run(experiment))


def test_an_experiment_asked_for_twice_is_trained_once(monkeypatch):
    trained = []
    monkeypatch.setattr(
        store, "run", lambda e, **options: (trained.append(e), run(e, **options))[1]
    )
    with ThreadPoolExecutor(2) as executor:
        study = fetch_all([QUICK, QUICK], executor=executor, progress=False)
    assert trained == [QUICK]
    assert len(study) == 1


def test_the_bar_counts_episodes_and_shows_the_latest_cost(capsys):
    with ThreadPoolExecutor(1) as executor:
        fetch_all([Experiment(learner="frozen", episodes=3, steps=2)], executor=executor)
    shown = capsys.readouterr().err
    assert "3/3" in shown
    assert "1/1 done" in shown
    assert "cost" in shown


def test_one_failing_run_does_not_keep_the_others_from_being_stored(monkeypatch):
    experiments = sweep(learner="frozen", seed=[0, 1, 2], episodes=1, steps=2)

    def run_but_one(experiment, **options):
        if experiment.seed == 1:
            raise ArithmeticError("a mistake")
        return run(experiment, **options)

    monkeypatch.setattr(store, "run", run_but_one)
    with ThreadPoolExecutor(1) as executor, pytest.raises(ArithmeticError, match="a mistake"):
        fetch_all(experiments, executor=executor, progress=False)
    assert [fields["seed"] for fields, _ in stored().values()] == [0, 2]


def kill_workers_once_stored(runs: Path, killed: list[int]) -> None:
    """Wait for the first whole run, then kill every worker."""
    for _ in range(1200):
        if any(runs.glob("[!.]*.npz")):
            break
        time.sleep(0.05)
    for child in multiprocessing.active_children():
        if child.name.startswith("SpawnProcess"):  # the manager has a name of its own
            os.kill(child.pid, signal.SIGKILL)
            killed.append(child.pid)


@pytest.mark.slow
def test_a_killed_worker_costs_only_the_run_it_was_at(runs):
    short = Experiment(learner="frozen", episodes=1, steps=3)
    long = Experiment(learner="ES", episodes=8, steps=100, evaluate_every=8)
    killed: list[int] = []
    killer = threading.Thread(target=kill_workers_once_stored, args=(runs, killed))
    killer.start()
    study = fetch_all([short, long], workers=1, progress=False)
    killer.join()
    assert killed
    assert_same_numbers(study[short], run(short))
    assert study[long].facts["stopped"] == "finished"
    assert set(runs.glob("*.npz")) == {path_of(short), path_of(long)}


@pytest.mark.slow
def test_workers_that_are_killed_again_and_again_are_given_up(monkeypatch):
    monkeypatch.setattr(store, "_fetch_quietly", kill_oneself)
    with pytest.raises(Killed, match=f"killed {ATTEMPTS} times"):
        fetch_all([QUICK], workers=1, progress=False)


def kill_oneself(_: Experiment) -> float:
    os.kill(os.getpid(), signal.SIGKILL)
    return 0.0


def test_an_executor_of_the_callers_is_not_replaced():
    class Breaking(ThreadPoolExecutor):
        def submit(self, *_, **__):
            broken: Future = Future()
            broken.set_exception(BrokenProcessPool("a worker was killed"))
            return broken

    with Breaking(1) as executor, pytest.raises(BrokenProcessPool):
        fetch_all([QUICK], executor=executor, progress=False)


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
