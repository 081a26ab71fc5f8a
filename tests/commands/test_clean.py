"""`nmpcrl clean`: it says what can go, deletes only that, and nothing beyond the folder of runs."""

import os
from dataclasses import replace

import pytest

from nmpcrl.analysis import summaries
from nmpcrl.analysis.summary import summarise
from nmpcrl.study import Experiment, fetch, store

RUN = Experiment(episodes=1, steps=5)
NAME = "ES-A-step-seed0-1ep-0123456789"


@pytest.fixture
def folder(command, tmp_path):
    """A finished run, its summary, one file of each kind that can go, and files of nobody's."""
    records = fetch(RUN)
    summarise(records).save(summaries.path_of(RUN))
    place, inner = store.folder(), summaries.folder()
    replace(records, facts=records.facts | {"key": "other"}).save(place / f"{NAME}.npz")
    for path in (
        *(place / f"{NAME}.damaged", place / f"{NAME}.damaged2", place / f"{NAME}.svg"),
        *(place / ".half-a.tmp", inner / f"{NAME}.failed.json", inner / ".half-b.tmp"),
        *(
            place / ".half-new.tmp",
            place / "thesis.pdf",
            place / "thesis.svg",
            place / "bench.json",
        ),
        *(place / f"{NAME[:-1]}a.npz", place / "damaged.npz", tmp_path / f"{NAME}.damaged"),
    ):
        path.write_bytes(b"x" * 10)
    for path in (place / ".half-a.tmp", inner / ".half-b.tmp"):
        os.utime(path, (1e9, 1e9))
    return place


def files(place) -> set[str]:
    return {
        path.relative_to(place).as_posix()
        for path in place.rglob("*")
        if path.is_file() and ".reservations" not in path.parts
    }


GOING = {
    f"{NAME}.npz": "old",
    f"{NAME}.damaged": "damaged",
    f"{NAME}.damaged2": "damaged",
    f"{NAME}.svg": "pictures",
    ".half-a.tmp": "half",
    "summaries/.half-b.tmp": "half",
    f"summaries/{NAME}.failed.json": "failed",
}


def test_it_says_what_would_go_and_how_much_room_that_makes_and_deletes_nothing(command, folder):
    before = files(folder)
    said = command("clean")
    assert said.exit_code == 0, said.output
    assert files(folder) == before
    for name, kind in GOING.items():
        assert str(folder / name) in said.stdout
        assert f"{kind}: " in said.stdout
    assert f"{len(GOING)} files, " in said.stdout
    assert "Nothing is deleted; --yes deletes them." in said.stdout


def test_with_yes_it_deletes_that_and_nothing_else(command, folder, tmp_path):
    before = files(folder)
    done = command("clean", "--yes")
    assert done.exit_code == 0, done.output
    assert before - files(folder) == set(GOING)
    assert f"{len(GOING)} files deleted: " in done.stdout
    assert (tmp_path / f"{NAME}.damaged").exists()
    assert "Nothing in" in command("clean").stdout


@pytest.mark.parametrize("kind", sorted(set(GOING.values())))
def test_only_what_is_asked_for_goes(command, folder, kind):
    before = files(folder)
    command("clean", "--only", kind, "--yes")
    assert before - files(folder) == {name for name, other in GOING.items() if other == kind}


def test_finished_runs_go_only_if_they_are_asked_for(command, folder):
    own = {store.path_of(RUN).name, f"summaries/{summaries.path_of(RUN).name}"}
    before = files(folder)
    assert own <= before
    command("clean", "--yes")
    assert own <= files(folder)
    command("clean", "--runs", "--yes")
    assert before - files(folder) == set(GOING) | own


@pytest.mark.parametrize("name", [NAME.replace("seed0", "seed7"), f"{NAME[:-1]}8"])
def test_a_run_of_this_code_that_somebody_renamed_stays(command, folder, name):
    renamed = store.path_of(RUN).rename(folder / f"{name}.npz")
    command("clean", "--yes")
    assert renamed.exists()


def test_a_run_that_would_be_trained_again_goes(command, folder):
    records = fetch(RUN)
    replace(records, facts=records.facts | {"sources": "another"}).save(store.path_of(RUN))
    command("clean", "--yes")
    assert not store.path_of(RUN).exists()


def test_a_run_that_cannot_be_read_now_stays(command, folder):
    command("clean", "--runs", "--yes")
    assert f"{NAME[:-1]}a.npz" in files(folder)


def test_a_link_is_neither_followed_nor_deleted(command, folder, tmp_path):
    outside = tmp_path / "outside"
    outside.mkdir()
    kept = [outside / f"{NAME}.damaged", outside / ".half-a.tmp"]
    for path in kept:
        path.write_bytes(b"x")
        os.utime(path, (1e9, 1e9))
    link = folder / f"{NAME}.damaged3"
    link.symlink_to(kept[0])
    summaries.folder().rename(folder / "elsewhere")
    summaries.folder().symlink_to(outside)
    assert command("clean", "--runs", "--yes").exit_code == 0
    assert link.is_symlink()
    assert all(path.exists() for path in kept)


def test_where_no_folder_is_nothing_can_go(command, tmp_path):
    assert "Nothing in" in command("clean", "--yes").stdout
    assert not (tmp_path / "runs").exists()
