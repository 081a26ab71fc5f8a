"""A study is trained run by run: nothing twice, nothing lost, and a failure stops no other run."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nmpcrl.analysis import summaries
from nmpcrl.analysis.summaries import Failed, fetch_summaries
from nmpcrl.analysis.summary import RunSummary, summarise
from nmpcrl.study import Experiment, fetch, provenance, run, store, sweep
from nmpcrl.study.storage import executor
from nmpcrl.study.storage.executor import Killed

QUICK = Experiment("frozen", episodes=2, steps=3, evaluate_every=1)
SIX = sweep(learner="frozen", seed=tuple(range(6)), episodes=1, steps=2)
THREE = SIX[:3]
CLOCK = "seconds"

MADE_ELSEWHERE = """
import os, signal, time
from pathlib import Path

from nmpcrl.analysis import summaries

LOG = Path({log!r})


def make(experiment, *expected):
    first = f"began {{experiment.seed}} " not in LOG.read_text()
    note("began", experiment)
    time.sleep({pause} if experiment.seed > 1 else 0)
    if experiment.seed in {killed} and first:
        os.kill(os.getpid(), signal.{by})
    made = summaries.make(experiment, *expected)
    note("ended", experiment)
    return made


def note(what, experiment):
    with LOG.open("a") as log:
        log.write(f"{{what}} {{experiment.seed}} {{os.getpid()}}\\n")
"""


@pytest.fixture(autouse=True)
def folder(runs) -> Path:
    return runs / "summaries"


@pytest.fixture
def trained(monkeypatch) -> list[Experiment]:
    """What is trained from here on, in this process."""
    found: list[Experiment] = []
    monkeypatch.setattr(summaries, "run", lambda e: (found.append(e), run(e))[1])
    return found


@pytest.fixture
def workers(tmp_path, monkeypatch):
    """Let workers note what they do, and let the runs of some seeds kill them, once."""

    def watch(
        killed: tuple[int, ...] = (),
        *,
        by: str = "SIGKILL",
        pause: float = 0,
    ) -> Path:
        log = tmp_path / "log"
        log.touch()
        text = MADE_ELSEWHERE.format(log=str(log), killed=killed, by=by, pause=pause)
        (tmp_path / "made_elsewhere.py").write_text(text)
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.delitem(sys.modules, "made_elsewhere", raising=False)
        import made_elsewhere

        monkeypatch.setattr(summaries, "make", made_elsewhere.make)
        return log

    return watch


def here(experiments, **options):
    """The summaries, made in this process one after the other."""
    with ThreadPoolExecutor(1) as one:
        return fetch_summaries(experiments, executor=one, progress=False, **options)


def test_without_numba_nothing_is_trained_that_could_not_be_kept(monkeypatch):
    monkeypatch.setattr(summaries, "run", lambda _: pytest.fail("it was trained"))
    monkeypatch.setattr(summaries, "environment", lambda: {"numba": "absent"})
    with pytest.raises(summaries.OtherSolver, match="riccati, which 6 of the missing runs name"):
        here(SIX)


def test_threads_of_one_process_make_what_one_makes(monkeypatch, tmp_path):
    """Torch's generator, from which networks are drawn, is one for the whole process."""
    networks = sweep(learner=("DES", "RDES"), seed=tuple(range(4)), episodes=3, steps=40)
    alone = here(networks)
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "again"))
    with ThreadPoolExecutor(4) as threads:
        together = fetch_summaries(networks, executor=threads, progress=False)
    for one in networks:
        assert_same_summary(alone[one], together[one])


def times(log: Path, what: str) -> list[int]:
    """The seeds that have begun or ended, as often as they did."""
    lines = [line.split() for line in log.read_text().splitlines()]
    return sorted(int(seed) for said, seed, _ in lines if said == what)


def assert_same_summary(one: RunSummary, other: RunSummary):
    for columns, others in (
        (one.episodes, other.episodes),
        (one.evaluations, other.evaluations),
        ({"states": one.states}, {"states": other.states}),
        ({"actions": one.actions}, {"actions": other.actions}),
    ):
        for name in set(columns) - {CLOCK}:
            np.testing.assert_array_equal(columns[name], others[name])


@pytest.mark.slow
def test_what_is_fetched_is_the_summary_of_the_run():
    experiments = sweep(learner=("RDES", "GES"), episodes=2, steps=65)
    study = fetch_summaries(experiments, workers=2, progress=False)
    assert list(study) == list(experiments)
    for experiment in experiments:
        assert_same_summary(study[experiment], summarise(run(experiment)))


def test_a_summary_is_stored_among_the_runs_and_says_what_it_depends_on(folder):
    found = here([QUICK])[QUICK]
    (path,) = folder.iterdir()
    assert path == summaries.path_of(QUICK)
    assert path.name.startswith("frozen-A-step-seed0-2ep-")
    assert_same_summary(RunSummary.load(path), found)
    assert found.facts["key"] == provenance.key(QUICK)
    assert found.facts["versions"] == provenance.environment()
    assert found.facts["sources"] == provenance.sources_hash()
    assert store.stored() == {}  # the run itself is not kept


def test_a_stored_summary_is_read_and_not_made_again(trained):
    first = here([QUICK])
    again = here([QUICK, QUICK])
    assert trained == [QUICK]
    assert_same_summary(again[QUICK], first[QUICK])


def test_a_run_that_is_stored_whole_is_summarised_and_not_trained_again(trained):
    records = fetch(QUICK)
    found = here([QUICK])
    assert trained == []
    assert_same_summary(found[QUICK], summarise(records))
    assert found[QUICK].facts["seconds"] == records.facts["seconds"]


def test_a_stored_run_that_is_damaged_is_trained_again(trained):
    fetch(QUICK)
    store.path_of(QUICK).write_bytes(b"")
    assert_same_summary(here([QUICK])[QUICK], summarise(run(QUICK)))
    assert trained == [QUICK]


def rewritten(path: Path, change) -> None:
    """A file with other members, whole in every other respect."""
    with np.load(path) as file:
        members = dict(file)
    np.savez_compressed(path, **change(members))


DAMAGES = {
    "bytes garbled": lambda path: garble(path, 20),
    "cut short": lambda path: path.write_bytes(path.read_bytes()[:-300]),
    "empty": lambda path: path.write_bytes(b""),
    "of another run": lambda path: shutil.copy(summaries.path_of(THREE[1]), path),
    "a run": lambda path: shutil.copy(store.path_of(THREE[0]), path),
    "another number": lambda path: rewritten(
        path, lambda kept: kept | {"episodes/cost": kept["episodes/cost"] + 1}
    ),
    "a column under another name": lambda path: rewritten(
        path, lambda kept: {name.replace("/cost", "/costs"): a for name, a in kept.items()}
    ),
    "another shape": lambda path: rewritten(
        path, lambda kept: kept | {"rollout/states": kept["rollout/states"][:, :2]}
    ),
}


def garble(path: Path, count: int) -> None:
    content = bytearray(path.read_bytes())
    for place in range(1, count + 1):
        content[place * len(content) // (count + 2)] ^= 0x5A
    path.write_bytes(bytes(content))


@pytest.mark.parametrize("name", DAMAGES)
def test_whatever_is_damaged_is_one_sentence_and_made_again(folder, capsys, name):
    fetch(THREE[0])
    first = here(THREE)
    path = summaries.path_of(THREE[0])
    DAMAGES[name](path)
    again = here(THREE)
    for experiment in THREE:
        assert_same_summary(again[experiment], first[experiment])
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert said.startswith(str(path))
    assert said.endswith(f"it is kept as {path.stem}.damaged, and the run is done again\n")
    assert_same_summary(RunSummary.load(path), first[THREE[0]])


def test_looking_whether_a_summary_is_stored_changes_nothing(folder, capsys):
    here([QUICK])
    path = summaries.path_of(QUICK)
    path.write_bytes(b"damaged")
    assert not summaries.is_stored(QUICK)
    assert path.read_bytes() == b"damaged"
    assert capsys.readouterr().err == ""


def test_a_run_that_another_solver_had_to_solve_is_a_failure(monkeypatch, folder):
    def run_by_another(experiment):
        records = run(experiment)
        solver = "fatrop" if experiment.seed == 1 else records.facts["solver"]
        return replace(records, facts=records.facts | {"solver": solver})

    monkeypatch.setattr(summaries, "run", run_by_another)
    with pytest.raises(Failed, match="OtherSolver: it was solved by fatrop and not by riccati"):
        here(THREE)
    assert [summaries.is_stored(e) for e in THREE] == [True, False, True]


@pytest.fixture
def mistaken(monkeypatch):
    """Let the runs of one seed fail; undone by calling what is returned."""

    def run_but_one(experiment):
        if experiment.seed == 1:
            raise ArithmeticError("a mistake")
        return run(experiment)

    monkeypatch.setattr(summaries, "run", run_but_one)
    return lambda: monkeypatch.setattr(summaries, "run", run)


def test_a_run_that_fails_is_told_at_the_end_and_stops_no_other(mistaken):
    with pytest.raises(Failed, match="1 of 3 runs failed") as raised:
        here(THREE)
    for part in (str(THREE[1]), "ArithmeticError: a mistake"):
        assert part in str(raised.value)
    assert [summaries.is_stored(e) for e in THREE] == [True, False, True]


def test_what_did_not_fail_can_be_had_without_the_rest(mistaken):
    assert list(here(THREE, strict=False)) == [THREE[0], THREE[2]]


def test_why_a_run_failed_is_written_down_beside_the_summaries(mistaken, folder):
    here(THREE, strict=False)
    (note,) = folder.glob("*.failed.json")
    said = json.loads(note.read_text())
    assert said["reason"] == "ArithmeticError: a mistake"
    assert "run_but_one" in said["traceback"]
    theta = tuple(said["experiment"]["theta"])
    assert Experiment(**said["experiment"] | {"theta": theta}) == THREE[1]


def test_what_failed_is_tried_again_and_the_note_goes(mistaken, folder, trained):
    here(THREE, strict=False)
    mistaken()
    assert list(here(THREE)) == list(THREE)
    assert list(folder.glob("*.failed.json")) == []


def test_long_runs_begin_first(trained):
    short = Experiment("ES", episodes=1, steps=2)
    experiments = [
        short,
        Experiment("frozen", episodes=1, steps=2, horizon=20),
        Experiment("DES", episodes=1, steps=2),
        Experiment("RDES", episodes=2, steps=2),
    ]
    study = here(experiments)
    assert [e.learner for e in trained] == ["RDES", "DES", "frozen", "ES"]
    assert list(study) == experiments


def test_a_bar_counts_the_runs(mistaken, capsys):
    with ThreadPoolExecutor(1) as one:
        fetch_summaries(THREE, executor=one, strict=False)
    shown = capsys.readouterr().err
    assert "3/3" in shown
    assert "1 failed" in shown


def test_nothing_to_do_needs_nobody(capsys):
    here([QUICK])
    capsys.readouterr()
    assert list(fetch_summaries([QUICK])) == [QUICK]
    assert list(fetch_summaries([])) == []
    assert capsys.readouterr().err == ""


def test_a_worker_with_other_code_trains_nothing(monkeypatch, trained):
    """A worker of a cluster may join late; so each compares signatures before each run."""
    make = summaries.make

    def by_another(*arguments):
        monkeypatch.setattr(summaries, "signature", lambda: "another")
        return make(*arguments)

    monkeypatch.setattr(summaries, "make", by_another)
    with pytest.raises(Failed, match="other code, or other versions"):
        here([QUICK])
    assert trained == []


def test_a_run_that_is_wanted_afresh_is_trained_though_it_is_stored(trained):
    fetch(QUICK)
    assert_same_summary(
        summaries.make(QUICK, provenance.signature(), afresh=True), summarise(run(QUICK))
    )
    assert trained == [QUICK]


def test_a_summary_of_a_stored_run_says_which_code_made_the_run(monkeypatch):
    fetch(QUICK)
    then = provenance.sources_hash()
    monkeypatch.setattr(provenance, "locked_hash", lambda: then)
    monkeypatch.setattr(provenance, "sources_hash", lambda: "edited since")
    assert here([QUICK])[QUICK].facts["sources"] == then


def test_a_summary_of_edited_code_is_made_again_when_the_edit_is_reverted(monkeypatch, trained):
    with monkeypatch.context() as edited:
        edited.setattr(provenance, "sources_hash", lambda: "of an edit")
        here([QUICK])
    assert not summaries.is_stored(QUICK)
    assert here([QUICK])[QUICK].facts["sources"] == provenance.sources_hash()
    assert len(trained) == 2


INTERRUPTED = """
import signal

import made_elsewhere
from nmpcrl.study import sweep
from nmpcrl.analysis import summaries

signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
summaries.make = made_elsewhere.make
runs = sweep(learner="frozen", seed=tuple(range(6)), episodes=1, steps=2)
summaries.fetch_summaries(runs, workers=2)
"""


@pytest.fixture
def interrupted(tmp_path):
    """A program that trains six runs, started in a session of its own as in a terminal."""
    program = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED],
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    yield program
    with contextlib.suppress(ProcessLookupError):
        os.killpg(program.pid, signal.SIGKILL)
    program.communicate()


@pytest.mark.slow
def test_an_interrupt_that_a_worker_meets_first_begins_nothing_anew(workers):
    """A terminal tells the whole group, in any order; the caller alone ends a study."""
    log = workers(killed=(0, 1), by="SIGINT")
    study = fetch_summaries(THREE, workers=2, progress=False)
    assert len(study) == 3
    assert times(log, "began") == times(log, "ended") == [0, 1, 2]


@pytest.mark.slow
def test_an_interrupted_study_goes_on_where_it_was(workers, folder, request):
    log = workers(pause=1000)
    program = request.getfixturevalue("interrupted")
    # the caller has kept the first two, and both workers are at a run that will not end by itself
    wait_until(lambda: len(times(log, "began")) == 4 and len(list(folder.glob("*.npz"))) == 2)
    os.killpg(program.pid, signal.SIGINT)  # as a terminal does: the whole group is told
    said = program.communicate(timeout=240)[1]
    assert program.returncode != 0
    assert said.count("Traceback") <= 1  # of the program, and of none of its workers
    stored = {path: path.stat().st_mtime_ns for path in folder.glob("*.npz")}
    assert len(stored) == 2
    assert len(times(log, "began")) == 4  # none is begun after the interruption
    workers()
    log.write_text("")
    fetch_summaries(SIX, workers=2, progress=False)
    assert len(times(log, "began")) == 4
    assert {path: path.stat().st_mtime_ns for path in stored} == stored


@pytest.mark.slow
def test_a_process_that_starts_while_a_study_is_interrupted_is_ended_too(monkeypatch):
    starting, process = threading.Event(), executor._process

    def slowly():
        starting.set()
        time.sleep(0.5)
        return process()

    monkeypatch.setattr(executor, "_process", slowly)
    slots = executor.Slots(1)
    began, waits = slots.submit(time.sleep, 20), slots.submit(time.sleep, 20)
    starting.wait()
    slots.shutdown(wait=False, cancel_futures=True)
    assert isinstance(began.exception(), Killed)
    assert waits.cancelled()


def wait_until(holds, seconds: float = 240.0):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "this was waited for in vain"
        time.sleep(0.02)
