"""Files appear whole and as readable as the umask lets them; halves of the dead are swept away."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from raising import raising

from nmpcrl.study.storage.atomic import OLD, sweep, try_to_write, write_json, write_whole
from nmpcrl.study.storage.machine import host


@pytest.fixture
def dead() -> int:
    """The number of a process that has ended."""
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    return ended.pid


def half(folder: Path, name: str, age: float = 0.0) -> Path:
    path = folder / f".half-{name}.tmp"
    path.write_bytes(b"half")
    os.utime(path, (time.time() - age,) * 2)
    return path


@pytest.mark.parametrize("umask", [0o022, 0o002, 0o077])
def test_a_file_has_the_mode_that_the_umask_leaves(tmp_path, umask):
    before = os.umask(umask)
    try:
        write_json(tmp_path / "one.json", [])
    finally:
        os.umask(before)
    assert (tmp_path / "one.json").stat().st_mode & 0o777 == 0o666 & ~umask


def test_while_it_is_filled_a_file_has_another_name_which_says_who_fills_it(tmp_path):
    names = []
    write_whole(tmp_path / "one", lambda _: names.extend(path.name for path in tmp_path.iterdir()))
    assert [name.rsplit("-", 1)[0] for name in names] == [f".half-{os.getpid()}-{host()}"]
    assert list(tmp_path.iterdir()) == [tmp_path / "one"]


def test_trying_to_write_leaves_nothing_behind(tmp_path):
    try_to_write(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_what_a_process_left_that_is_gone_is_swept_before_the_next_file(tmp_path, dead):
    left = half(tmp_path, f"{dead}-{host()}-0123")
    write_json(tmp_path / "one.json", [])
    assert not left.exists()


def test_what_a_living_process_fills_is_left_however_long_it_takes(tmp_path):
    filling = half(tmp_path, f"{os.getpid()}-{host()}-0123", age=30 * OLD)
    sweep(tmp_path)
    assert filling.exists()


@pytest.mark.parametrize("name", ["123-0badcafe-0123", "abcdefgh", "x-y-z"])
def test_what_another_host_fills_is_left_until_it_is_old(tmp_path, name):
    filling, old = half(tmp_path, name), half(tmp_path, f"{name}4", age=2 * OLD)
    sweep(tmp_path)
    assert filling.exists()
    assert not old.exists()


def test_a_folder_is_swept_once_a_process(tmp_path, dead):
    sweep(tmp_path)
    left = half(tmp_path, f"{dead}-{host()}-0123")
    write_json(tmp_path / "one.json", [])
    assert left.exists()


def test_what_cannot_be_removed_hinders_nobody(tmp_path, dead, monkeypatch):
    left = half(tmp_path, f"{dead}-{host()}-0123")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", raising(PermissionError("not yours")))
        sweep(tmp_path)
    assert left.exists()


def test_a_folder_where_a_file_should_be_stays_and_nothing_else_is_left(tmp_path):
    (tmp_path / "one.json").mkdir()
    with pytest.raises(IsADirectoryError):
        write_json(tmp_path / "one.json", [])
    assert list(tmp_path.iterdir()) == [tmp_path / "one.json"]


def test_who_reads_a_file_meanwhile_sees_all_of_the_one_before(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"before")
    with path.open("rb") as reader:
        write_whole(path, lambda file: file.write(b"after"))
        assert reader.read() == b"before"
    assert path.read_bytes() == b"after"
