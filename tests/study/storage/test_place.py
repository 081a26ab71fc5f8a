"""Where runs are kept: it is refused before any work, and what it does not take is not lost."""

import errno
import os
import shutil
import subprocess
import sys
import tempfile
from collections import namedtuple
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from raising import raising

from nmpcrl.analysis import summaries
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.study import (
    Experiment,
    Records,
    StoreError,
    fetch,
    fetch_all,
    store,
    stored,
)
from nmpcrl.study.storage import archive, place
from nmpcrl.study.storage.place import check_folder, keep
from nmpcrl.study.store import path_of, size_of

QUICK = Experiment(learner="frozen", episodes=2, steps=3, evaluate_every=1)
Usage = namedtuple("Usage", "total used free")


@pytest.fixture(autouse=True)
def runs(tmp_path, monkeypatch) -> Path:
    """A folder of this test's own, which nobody has made yet; and one for what it does not take."""
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    return tmp_path / "runs"


@pytest.fixture
def untrained(monkeypatch):
    """From here on, training is a mistake."""
    refuse = raising(AssertionError("a run was trained that could not be kept"))
    for module in (store, summaries):
        monkeypatch.setattr(module, "run", refuse)
        monkeypatch.setattr(module, "compile_ahead", refuse)


def a_file(runs: Path) -> Path:
    runs.write_text("no folder")
    return runs


def below_a_file(runs: Path) -> Path:
    return a_file(runs) / "below" / "runs"


def a_link_to_nowhere(runs: Path) -> Path:
    runs.symlink_to(runs.parent / "nowhere")
    return runs


ASKED = {
    "one": lambda: fetch(QUICK),
    "many": lambda: fetch_all([QUICK], progress=False),
    "summaries": lambda: fetch_summaries([QUICK], progress=False),
}
each_way = pytest.mark.parametrize("ask", ASKED.values(), ids=ASKED)


@each_way
@pytest.mark.parametrize("spoilt", [a_file, below_a_file, a_link_to_nowhere])
def test_what_is_no_folder_is_refused_before_any_work(runs, untrained, monkeypatch, spoilt, ask):
    monkeypatch.setenv("NMPCRL_RUNS", str(spoilt(runs)))
    with pytest.raises(StoreError, match=r"where runs are kept, cannot be a folder: .* is a file"):
        ask()


@each_way
def test_a_folder_that_cannot_be_made_is_refused_before_any_work(untrained, ask, monkeypatch):
    monkeypatch.setattr(Path, "mkdir", raising(PermissionError(errno.EACCES, "Permission denied")))
    with pytest.raises(
        StoreError, match=r"runs.*, cannot be made \(Permission denied\); correct that, or set NMPC"
    ):
        ask()


@each_way
def test_a_folder_without_room_is_refused_before_any_work(untrained, ask, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(10**6, 10**6, 0))
    with pytest.raises(StoreError, match=r"runs.*, has room for 0\.00 MB of the needed 0\.\d\d MB"):
        ask()


@each_way
def test_a_folder_that_cannot_be_written_is_refused_before_any_work(untrained, ask, read_only):
    with pytest.raises(StoreError, match=r"cannot be (made|written) \(Read-only file system\)"):
        ask()


def mounted(place: Path, *options: str) -> Path:
    place.mkdir(exist_ok=True)
    command = ["mount", "-t", "tmpfs", *options, "none", str(place)]
    try:
        done = subprocess.run(command, capture_output=True, check=False)
    except FileNotFoundError:
        pytest.skip("there is no mount")
    if done.returncode:
        pytest.skip("only root may mount a file system")
    return place


@pytest.fixture
def read_only(runs):
    yield mounted(runs, "-o", "ro")
    subprocess.run(["umount", str(runs)], check=True)


@pytest.fixture
def small(runs):
    """A file system of 64 kB; more than the run takes, less than it may take."""
    yield mounted(runs, "-o", "size=64k")
    subprocess.run(["umount", str(runs)], check=True)


def test_what_is_stored_on_a_read_only_file_system_is_read(runs):
    mounted(runs)
    try:
        records = fetch(QUICK)
        subprocess.run(["mount", "-o", "remount,ro", str(runs)], check=True)
        assert fetch(QUICK).facts == records.facts
        assert fetch_all([QUICK], progress=False)[QUICK].facts == records.facts
        assert list(stored()) == [path_of(QUICK)]
    finally:
        subprocess.run(["umount", str(runs)], check=True)


def test_a_file_is_no_empty_folder(runs):
    runs.write_text("no folder")
    with pytest.raises(StoreError, match=r"runs, where runs are kept, cannot be read \(Not a dir"):
        stored()


def test_a_folder_that_nobody_may_read_is_no_empty_folder(runs, monkeypatch):
    monkeypatch.setattr(
        Path, "iterdir", raising(PermissionError(errno.EACCES, "Permission denied"))
    )
    with pytest.raises(StoreError, match=r"cannot be read \(Permission denied\)"):
        stored()


def test_an_empty_name_of_a_folder_is_none(monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", "")
    assert place.folder() == Path("runs")


def test_a_folder_that_is_fit_is_made_and_left_empty(runs):
    check_folder(10**6)
    assert list(runs.iterdir()) == []


@pytest.mark.parametrize(
    "experiment",
    [
        QUICK,
        Experiment("GES", episodes=20, steps=30, evaluate_every=7),
        Experiment("TDC", episodes=3, steps=100, evaluate_every=1),
    ],
)
def test_a_run_takes_no_more_than_is_asked_for(experiment):
    fetch(experiment)
    assert path_of(experiment).stat().st_size <= size_of(experiment)
    fetch_here([experiment])
    assert summaries.path_of(experiment).stat().st_size <= summaries.size_of(experiment)


def fetch_here(experiments):
    """Summaries, made in this process."""
    with ThreadPoolExecutor(1) as one:
        return fetch_summaries(experiments, executor=one, progress=False)


def fetch_all_here(experiments):
    with ThreadPoolExecutor(1) as one:
        return fetch_all(experiments, executor=one, progress=False)


@pytest.fixture
def full(runs, monkeypatch):
    """From here on, no run is written among the runs."""
    write_whole = archive.write_whole

    def refuse(path, write):
        if runs in path.parents:
            raise OSError(errno.ENOSPC, "No space left on device")
        write_whole(path, write)

    monkeypatch.setattr(archive, "write_whole", refuse)


WAYS = {
    "one": (lambda: fetch(QUICK), path_of, Records),
    "many": (lambda: fetch_all_here([QUICK])[QUICK], path_of, Records),
    "summaries": (lambda: fetch_here([QUICK])[QUICK], summaries.path_of, RunSummary),
}


@pytest.mark.parametrize("way", WAYS)
def test_what_cannot_be_written_is_returned_and_kept_elsewhere(runs, full, capsys, way):
    ask, path_of, kind = WAYS[way]
    found, said = ask(), capsys.readouterr().err
    elsewhere = Path(tempfile.tempdir) / f"nmpcrl-runs-{os.getuid()}"
    (kept,) = elsewhere.rglob("*.npz")
    assert kept.relative_to(elsewhere) == path_of(QUICK).relative_to(runs)
    assert said == (
        f"{path_of(QUICK)} cannot be written (No space left on device); it is kept as {kept}:"
        f" move it, or set NMPCRL_RUNS={elsewhere}\n"
    )
    assert kind.load(kept).facts == found.facts
    assert elsewhere.stat().st_mode & 0o777 == 0o700
    assert list(runs.rglob("*.npz")) == []


@pytest.mark.parametrize("way", WAYS)
def test_what_can_be_written_nowhere_is_returned_at_least(full, capsys, monkeypatch, way):
    monkeypatch.setattr(tempfile, "tempdir", "/proc/nowhere")
    assert WAYS[way][0]().facts["stopped"] == "finished"
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "cannot be written (No space left on device), nor anything in /proc/nowhere (" in said
    assert "; it is not stored" in said


@pytest.mark.parametrize("mode", [0o777, 0o755])
def test_a_temporary_folder_that_others_can_read_is_not_used(full, capsys, mode):
    elsewhere = Path(tempfile.tempdir) / f"nmpcrl-runs-{os.getuid()}"
    elsewhere.mkdir()
    elsewhere.chmod(mode)
    fetch(QUICK)
    assert f"{elsewhere} is open to others" in capsys.readouterr().err
    assert list(elsewhere.iterdir()) == []


def test_a_temporary_folder_of_another_user_is_not_used(full, capsys, monkeypatch):
    user = os.getuid()
    elsewhere = Path(tempfile.tempdir) / f"nmpcrl-runs-{user + 1}"
    elsewhere.mkdir(mode=0o700)
    monkeypatch.setattr(os, "getuid", lambda: user + 1)
    fetch(QUICK)
    assert f"{elsewhere} is open to others" in capsys.readouterr().err


def test_a_study_goes_on_where_its_notes_cannot_be_written(runs, capsys, monkeypatch):
    monkeypatch.setattr(
        summaries, "write_json", raising(OSError(errno.ENOSPC, "No space left on device"))
    )
    monkeypatch.setattr(summaries, "run", lambda _: 1 / 0)
    with pytest.raises(summaries.Failed, match="1 of 1 runs failed"):
        fetch_here([QUICK])
    said = capsys.readouterr().err
    assert ".failed.json cannot be written (No space left on device): ZeroDivisionError" in said


LIMITED = """
import resource, sys
from nmpcrl.study import Experiment, fetch

e = Experiment(learner="frozen", episodes=20, steps=30)
resource.setrlimit(resource.RLIMIT_FSIZE, (8192, resource.RLIM_INFINITY))
records = fetch(e)
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
print(records.facts["stopped"], len(records.steps["cost"]))
"""


@pytest.mark.slow
def test_a_file_that_may_not_grow_costs_no_run(runs):
    """As on a full disk, the system refuses a write in the middle of a file."""
    done = subprocess.run(
        [sys.executable, "-c", LIMITED],
        env=os.environ | {"TMPDIR": tempfile.tempdir, "NMPCRL_WARNED": "1"},
        capture_output=True,
        check=True,
        text=True,
    )
    assert done.stdout.split() == ["finished", "600"]
    assert done.stderr.count("\n") == 1
    assert "cannot be written (File too large), nor anything in" in done.stderr
    assert [path for path in runs.rglob("*") if path.suffix] == []


def test_a_full_disk_costs_no_run(small, capsys, monkeypatch):
    """Between the look at the disk and the end of the training, somebody else fills it."""
    real = store.run

    def run_while_another_writes(*arguments, **options):
        with (small / "another").open("wb", buffering=0) as file, suppress(OSError):
            while file.write(bytes(4096)):
                pass
        return real(*arguments, **options)

    monkeypatch.setattr(store, "run", run_while_another_writes)
    assert fetch(QUICK).facts["stopped"] == "finished"
    assert "cannot be written (No space left on device); it is kept" in capsys.readouterr().err
    assert [path.name for path in small.iterdir() if path.is_file()] == ["another"]


def test_a_disk_that_is_too_small_is_refused_before_any_work(small, untrained):
    long = Experiment(episodes=10, steps=100)
    with pytest.raises(StoreError, match=r"has room for 0\.07 MB of the needed 0\.33 MB"):
        fetch(long)


def test_what_is_kept_where_it_belongs_says_nothing(runs, capsys):
    assert keep(runs / "one", lambda path: path.parent.mkdir())
    assert capsys.readouterr().err == ""


def test_a_folder_where_a_run_belongs_is_set_aside(runs, capsys):
    path_of(QUICK).mkdir(parents=True)
    summaries.path_of(QUICK).mkdir(parents=True)
    fetch(QUICK)
    fetch_here([QUICK])
    said = capsys.readouterr().err.splitlines()
    assert [line.partition(" ")[2] for line in said] == [
        f"is a folder where the file of a run belongs; it is kept as {path.name}, and the run is"
        " done again"
        for path in (
            path_of(QUICK).with_suffix(".damaged"),
            summaries.path_of(QUICK).with_suffix(".damaged"),
        )
    ]
    assert path_of(QUICK).is_file()
    assert summaries.path_of(QUICK).is_file()


def test_a_file_where_the_summaries_belong_is_refused_before_any_work(runs, untrained):
    runs.mkdir()
    (runs / "summaries").write_text("no folder")
    with pytest.raises(StoreError, match="summaries is a file"):
        fetch_summaries([QUICK], progress=False)


def test_a_run_that_may_not_be_read_is_not_taken_for_a_damaged_one(untrained, monkeypatch):
    path = path_of(QUICK)

    path.parent.mkdir()
    path.write_text("whole, for all we know")
    with monkeypatch.context() as patch:
        patch.setattr(np, "load", raising(PermissionError(errno.EACCES, "Permission denied")))
        with pytest.raises(StoreError, match=r"cannot be read \(Permission denied\); correct that"):
            fetch(QUICK)
    assert path.read_text() == "whole, for all we know"
