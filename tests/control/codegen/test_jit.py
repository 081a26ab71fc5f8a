"""Machine code is compiled once, found again, and compiled again when something happened to it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from nmpcrl.control.codegen import folder, jit

TEXT = """
from numba import float64, njit

@njit(float64(float64), cache=True)
def double(x):
    return 2.0 * x
"""
SCRIPT = f"""
from nmpcrl.control.codegen.jit import load
print(load("tiny", {{"__init__": {TEXT!r}}}, "Compiling ...").double(4.0))
"""
TURNS = f"""
import os, sys
from nmpcrl.control.codegen.jit import load
for cache in sys.argv[1:]:
    os.environ["NMPCRL_CACHE"] = cache
    package = load("tiny", {{"__init__": {TEXT!r}}}, "Compiling ...")
    print(package.double(4.0))
    print(cache, file=sys.stderr)
    del sys.modules[package.__name__]
"""
SOLVE = """
import numpy as np
from nmpcrl.study import paper
print(round(paper.nmpc().solve(np.array(paper.START), np.array(paper.THETA_INIT)).value))
"""


def said(cache: Path | None, script: str = SCRIPT, answer: str = "8.0") -> list[str]:
    """What another process that needs the code prints on standard error."""
    chosen = {} if cache is None else {"NMPCRL_CACHE": str(cache)}
    command = [sys.executable, "-c", script]
    ended = subprocess.run(command, capture_output=True, text=True, env=os.environ | chosen)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.strip() == answer
    return ended.stderr.splitlines()


def said_in_turn(caches: list[Path]) -> list[list[str]]:
    """What one process prints that looks for the code in one cache after the other."""
    command = [sys.executable, "-c", TURNS, *map(str, caches)]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.split() == ["8.0"] * len(caches)
    found: list[list[str]] = [[]]
    for line in ended.stderr.splitlines():
        if line == str(caches[len(found) - 1]):
            found.append([])
        else:
            found[-1].append(line)
    return found[:-1]


@pytest.fixture(scope="module")
def filled(tmp_path_factory) -> Path:
    """A cache that a process found empty."""
    cache = tmp_path_factory.mktemp("cache")
    first = said(cache)
    assert len(first) == 1
    assert first[0].startswith("Compiling ... done in ")
    return cache


@pytest.fixture
def full(filled, tmp_path) -> Path:
    """A cache of this test's own in which the code is already."""
    return shutil.copytree(filled, tmp_path / "cache")


@pytest.mark.slow
def test_a_second_process_does_not_compile(full):
    assert said(full) == []


@pytest.mark.slow
def test_a_process_finds_the_solver_that_another_compiled(controllers):
    controllers["riccati"].solve([-2.5, 1.5, 0.0], [1, 1, 0.05, 0.05, 0.05, 1, 1, 0.1, 0.001])
    assert said(None, SOLVE, "1037") == []


DAMAGES = [
    ("*.nbi", "emptied"),
    ("*.nbi", "cut"),
    ("*.nbc", "emptied"),
    ("*.nbc", "cut"),
    ("*.nbc", "garbled"),
    ("__init__.py", "emptied"),
    ("__init__.py", "garbled"),
]


@pytest.fixture(scope="module")
def after_damage(filled, tmp_path_factory) -> dict[tuple[str, str], list[list[str]]]:
    """By damage: what the next process prints, and the one after it."""
    folder, caches = tmp_path_factory.mktemp("damaged"), []
    for number, (pattern, damage) in enumerate(DAMAGES):
        caches.append(shutil.copytree(filled, folder / str(number)))
        (file,) = caches[-1].rglob(pattern)
        content = file.read_bytes()
        changed = {"emptied": b"", "cut": content[: len(content) // 2], "garbled": b"= " + content}
        file.write_bytes(changed[damage])
    first, second = said_in_turn(caches), said_in_turn(caches)
    return dict(zip(DAMAGES, map(list, zip(first, second, strict=True)), strict=True))


@pytest.mark.slow
@pytest.mark.parametrize(("pattern", "damage"), DAMAGES)
def test_a_damaged_file_is_noticed_and_compiled_again(after_damage, pattern, damage):
    lines, later = after_damage[pattern, damage]
    assert len(lines) == 2
    assert "is damaged" in lines[0]
    assert lines[0].endswith("and is compiled again")
    assert lines[1].startswith("Compiling ... done in ")
    assert later == []


@pytest.mark.slow
def test_an_interrupted_compilation_is_repeated(full):
    (complete,) = full.rglob(jit.COMPLETE)
    complete.unlink()
    lines = said(full)
    assert len(lines) == 1
    assert lines[0].startswith("Compiling ... done in ")
    assert said(full) == []


def test_an_interruption_leaves_nothing_that_counts_as_complete(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_CACHE", str(tmp_path))
    text = TEXT + "\nraise KeyboardInterrupt\n"
    with pytest.raises(KeyboardInterrupt):
        jit.load("stopped", {"__init__": text})
    assert not [*tmp_path.rglob(jit.COMPLETE)]
    assert not [name for name in sys.modules if name.startswith("stopped_")]


@pytest.mark.slow
def test_two_processes_at_once_do_not_disturb_each_other(tmp_path):
    command, chosen = [sys.executable, "-c", SCRIPT], {"NMPCRL_CACHE": str(tmp_path)}
    started = [
        subprocess.Popen(command, env=os.environ | chosen, stdout=-1, stderr=-1) for _ in range(2)
    ]
    for process in started:
        out, _ = process.communicate(timeout=60)
        assert out.strip() == b"8.0"
    assert said(tmp_path) == []


def test_other_text_or_another_numba_is_other_code(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_CACHE", str(tmp_path))
    jit.load("tiny", {"__init__": "x = 1\n"})
    jit.load("tiny", {"__init__": "x = 2\n"})
    monkeypatch.setattr(jit, "numba_version", lambda: "0.1")
    assert jit.load("tiny", {"__init__": "x = 1\n"}).x == 1
    assert len([*tmp_path.iterdir()]) == 3


@pytest.mark.parametrize(
    "chosen", [{}, {"XDG_CACHE_HOME": "/somewhere"}, {"NMPCRL_CACHE": "/here"}]
)
def test_the_cache_is_where_the_user_wants_it(monkeypatch, chosen):
    for name in ("NMPCRL_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in chosen.items():
        monkeypatch.setenv(name, value)
    places = {"XDG_CACHE_HOME": Path("/somewhere/nmpcrl"), "NMPCRL_CACHE": Path("/here")}
    name = next(iter(chosen), None)
    assert folder.chosen() == places.get(name, Path.home() / ".cache/nmpcrl")


@pytest.mark.parametrize("error", [MemoryError(), ImportError("cannot map it")])
def test_what_is_whole_and_cannot_be_loaded_stays(error, tmp_path, monkeypatch):
    """A process with too little memory may not take from the others what they have compiled."""
    monkeypatch.setenv("NMPCRL_CACHE", str(tmp_path))
    texts = {"__init__": f"answer = 42  # after {type(error).__name__}\n"}
    jit.load("whole", texts)
    (complete,) = tmp_path.rglob(jit.COMPLETE)
    sys.modules.pop(complete.parent.name)

    def fails(*_):
        raise error

    with monkeypatch.context() as patch:
        patch.setattr(jit.importing, "from_folder", fails)
        with pytest.raises(MemoryError):
            jit.load("whole", texts)
    assert complete.is_file()
    assert jit.load("whole", texts).answer == 42
