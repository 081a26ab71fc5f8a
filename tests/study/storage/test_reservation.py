"""Who trains in one folder shares it: no run is trained twice, and the dead reserve nothing."""

import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from raising import raising

from nmpcrl.analysis import summaries
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.study import Experiment, fetch, fetch_all, store, sweep
from nmpcrl.study.storage import reservation
from nmpcrl.study.storage.reservation import PLACE, Reservations, reservations
from nmpcrl.study.store import path_of

QUICK = Experiment(learner="frozen", episodes=1, steps=3)
FOUR = sweep(learner="frozen", seed=(0, 1, 2, 3), episodes=1, steps=2)


pytestmark = pytest.mark.usefixtures("runs")


def test_what_one_is_at_another_cannot_have(runs):
    one, other = Reservations(runs), Reservations(runs)
    assert one.take(["a", "b"]) == {"a", "b"}
    assert other.take(["b", "c"]) == {"c"}
    assert one.taken("abcd") == other.taken("abcd") == {"a", "b", "c"}
    one.release(["b"])
    assert other.take(["a", "b"]) == {"b"}


def test_what_a_thread_is_at_another_of_the_process_cannot_have(runs):
    one = Reservations(runs)
    assert one.take(["a"]) == {"a"}
    assert one.take(["a", "b"]) == {"b"}


def test_when_nobody_is_at_anything_one_lock_is_left_and_no_more(runs):
    several = [Reservations(runs) for _ in range(5)]
    for i, one in enumerate(several):
        one.take([str(i)])
    for one in several:
        one.release(map(str, range(5)))
    assert [path.name for path in (runs / PLACE).iterdir()] == ["lock"]


def test_a_process_has_one_set_of_reservations_in_a_folder_however_it_is_named(runs, monkeypatch):
    runs.mkdir()
    monkeypatch.chdir(runs.parent)
    assert reservations(Path("runs")) is reservations(runs)


HOLD = """
import sys, time
from pathlib import Path
from nmpcrl.study.storage.reservation import reservations

print(*sorted(reservations(Path(sys.argv[1])).take(sys.argv[2:])), flush=True)
time.sleep(600)
"""


@pytest.fixture
def holder(runs):
    """Start a process that reserves runs; it is killed in the end."""
    started = []

    def start(*names: str) -> subprocess.Popen:
        process = subprocess.Popen(
            [sys.executable, "-c", HOLD, str(runs), *names], stdout=subprocess.PIPE, text=True
        )
        started.append(process)
        assert process.stdout.readline().split() == list(names)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


@pytest.mark.slow
def test_what_a_process_was_at_that_is_killed_is_free_and_nothing_of_it_is_left(runs, holder):
    process, mine = holder("a", "b"), Reservations(runs)
    assert mine.take(["a", "c"]) == {"c"}
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert len(list((runs / PLACE).iterdir())) == 5  # the lock, and two files of each
    assert mine.take(["a", "b"]) == {"a", "b"}
    assert len(list((runs / PLACE).iterdir())) == 3


@pytest.mark.slow
def test_a_stopped_process_keeps_its_runs(runs, holder):
    process, mine = holder("a"), Reservations(runs)
    process.send_signal(signal.SIGSTOP)
    assert mine.take(["a"]) == set()


def test_a_note_that_is_no_note_reserves_nothing(runs):
    one, other = Reservations(runs), Reservations(runs)
    one.take(["a"])
    one._note.write_text("[")
    assert other.take(["a"]) == {"a"}


def test_where_nothing_can_be_reserved_everything_is_free(runs, monkeypatch):
    monkeypatch.setattr(reservation, "FileLock", raising(OSError("no locks here")))
    one, other = Reservations(runs), Reservations(runs)
    assert one.take(["a"]) == other.take(["a"]) == {"a"}
    assert one.taken(["a", "b"]) == {"a"}
    one.release(["a"])
    assert one.taken(["a"]) == set()


def test_two_who_want_a_run_train_it_once(runs, monkeypatch, capsys):
    began, go_on, trained = threading.Event(), threading.Event(), []
    real = store.run

    def slowly(experiment, **options):
        trained.append(experiment)
        began.set()
        go_on.wait()
        return real(experiment, **options)

    monkeypatch.setattr(store, "run", slowly)
    waits = store.wait_for
    monkeypatch.setattr(store, "wait_for", lambda *one: (go_on.set(), waits(*one)))
    found = []
    threads = [threading.Thread(target=lambda: found.append(fetch(QUICK))) for _ in range(2)]
    threads[0].start()
    began.wait()
    threads[1].start()
    for thread in threads:
        thread.join()
    assert len(found) == 2
    assert trained == [QUICK]
    said = f"{QUICK} is being trained by another process; waiting for it\n"
    assert capsys.readouterr().err == said


def test_who_waits_for_one_that_fails_trains_the_run_himself(runs, monkeypatch):
    other = Reservations(runs)
    other.take([path_of(QUICK).name])
    waits = store.wait_for

    def give_up(*one):
        other.release([path_of(QUICK).name])
        waits(*one)

    monkeypatch.setattr(store, "wait_for", give_up)
    assert fetch(QUICK).facts["stopped"] == "finished"


STUDY = """
import sys
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.study import fetch_all, store, sweep
from nmpcrl.analysis import summaries
import noted

store._fetch_quietly, summaries.make = noted.fetch, noted.make
four = sweep(learner="frozen", seed=(0, 1, 2, 3), episodes=1, steps=2)
ask = fetch_summaries if sys.argv[1] == "summaries" else fetch_all
print(len(ask(four, workers=1, progress=False)))
"""
NOTED = """
from pathlib import Path
import time

from nmpcrl.analysis import summaries
from nmpcrl.study import store

LOG, make_, fetch_, run = Path({log!r}), summaries.make, store._fetch_quietly, store.run


def noted(experiment, **options):
    with LOG.open("a") as log:
        log.write(f"{{experiment.seed}}\\n")
    time.sleep(0.3)
    return run(experiment, **options)


def make(*arguments):
    summaries.run = noted
    return make_(*arguments)


def fetch(*arguments):
    store.run = noted
    return fetch_(*arguments)
"""


@pytest.fixture
def studies(tmp_path):
    """Start studies on one folder; what they train is noted."""
    log = tmp_path / "log"
    log.touch()
    (tmp_path / "noted.py").write_text(NOTED.format(log=str(log)))
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = os.environ | {"PYTHONPATH": path, "NMPCRL_WARNED": "1"}
    started = []

    def start(way: str) -> subprocess.Popen:
        command = [sys.executable, "-c", STUDY, way]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        started.append(subprocess.Popen(command, env=environment, **pipes))
        return started[-1]

    yield start, log
    for study in started:
        study.kill()
        study.communicate()


@pytest.mark.slow
@pytest.mark.parametrize("way", ["runs", "summaries"])
def test_two_studies_on_one_folder_train_each_run_once(runs, studies, way):
    start, log = studies
    for study in (start(way), start(way)):
        out, err = study.communicate()
        assert study.returncode == 0, err
        assert out.split() == ["4"]
    assert sorted(log.read_text().split()) == ["0", "1", "2", "3"]
    here = runs / "summaries" if way == "summaries" else runs
    assert len(list(here.glob("*.npz"))) == 4
    assert [path.name for path in (runs / PLACE).iterdir()] == ["lock"]


@pytest.mark.slow
@pytest.mark.parametrize("way", ["runs", "summaries"])
def test_what_another_is_at_is_left_for_the_end_and_hinders_nothing(runs, holder, way, capsys):
    names = {e: path_of(e).name for e in FOUR}
    if way == "summaries":
        names = {e: f"summaries/{summaries.path_of(e).name}" for e in FOUR}
    process = holder(names[FOUR[1]])
    ask = fetch_summaries if way == "summaries" else fetch_all
    found: list = []
    thread = threading.Thread(
        target=lambda: found.append(ask(FOUR, workers=1, progress=False)), daemon=True
    )
    thread.start()
    here = runs / "summaries" if way == "summaries" else runs
    while len(list(here.glob("*.npz"))) < 3:
        thread.join(0.05)
    process.kill()
    thread.join()
    assert list(found[0]) == list(FOUR)
    assert f"{FOUR[1]} is being trained by another process" in capsys.readouterr().err


def test_notes_are_lists_of_names(runs):
    one = Reservations(runs)
    one.take(["b", "a"])
    (note,) = (runs / PLACE).glob("*.json")
    assert json.loads(note.read_text()) == ["a", "b"]
