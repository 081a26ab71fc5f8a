"""Machine code is compiled once, found again, compiled again after damage, and kept elsewhere where
its folder fails or is open to others."""

import errno
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from nmpcrl.control.codegen import folder, jit
from nmpcrl.control.codegen.source import CannotCompile

TEXT = """
from numba import float64, njit

@njit(float64(float64), cache=True)
def double(x):
    return 2.0 * x
"""
SCRIPT = f"""
import os, sys
from nmpcrl.control.codegen.jit import load
for cache in sys.argv[1:]:
    os.environ["NMPCRL_CACHE"] = cache
    package = load("tiny", {{"__init__": {TEXT!r}}}, "Compiling ...")
    assert package.double(4.0) == 8.0
    print(cache, file=sys.stderr)
    del sys.modules[package.__name__]
"""
SOLVE = """
import numpy as np
from nmpcrl.study import paper
assert round(paper.nmpc().solve(np.array(paper.START), np.array(paper.THETA_INIT)).value) == 1037
"""
ONCE = r"Compiling \.\.\. done in \d+ s\.\n"
ELSEWHERE = "; machine code is kept in a temporary folder until this process ends\n"
FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def said(*caches: Path, script: str = SCRIPT) -> list[str]:
    """What another process prints on standard error about each of these caches in turn."""
    command = [sys.executable, "-c", script, *map(str, caches)]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    return re.split("|".join(f"{cache}\n" for cache in caches) or "$", ended.stderr)[:-1]


@pytest.fixture(scope="module")
def filled(tmp_path_factory) -> Path:
    """A cache that a process found empty."""
    cache = tmp_path_factory.mktemp("cache")
    (first,) = said(cache)
    assert re.fullmatch(ONCE, first)
    return cache


@pytest.mark.slow
def test_what_one_process_compiled_the_next_one_finds(filled, controllers):
    assert said(filled) == [""]
    controllers["riccati"].solve([-2.5, 1.5, 0.0], [1, 1, 0.05, 0.05, 0.05, 1, 1, 0.1, 0.001])
    assert said(script=SOLVE) == [""]


@pytest.mark.slow
def test_damage_is_noticed_and_an_interrupted_compilation_repeated(filled, tmp_path):
    caches = {}
    for pattern in ("*.nbi", "*.nbc", "__init__.py"):
        (file,) = filled.rglob(pattern)
        content = file.read_bytes()
        for damaged in (b"", content[: len(content) // 2], b"= " + content):
            cache = shutil.copytree(filled, tmp_path / f"{len(caches)}")
            (cache / file.relative_to(filled)).write_bytes(damaged)
            caches[cache] = f"{len(damaged)} bytes in {file.name}"
    interrupted = shutil.copytree(filled, tmp_path / "interrupted")
    next(interrupted.rglob(jit.COMPLETE)).unlink()
    *first, last = said(*caches, interrupted)
    for damage, found in zip(caches.values(), first, strict=True):
        assert re.fullmatch(rf".* is damaged .* is compiled again\n{ONCE}", found), damage
    assert re.fullmatch(ONCE, last)
    assert not any(said(*caches, interrupted))


@pytest.mark.slow
def test_of_two_processes_at_once_one_compiles(tmp_path):
    command = [sys.executable, "-c", SCRIPT, str(tmp_path)]
    started = [subprocess.Popen(command, stderr=-1, text=True) for _ in range(2)]
    ends = [process.communicate(timeout=60)[1] for process in started]
    assert [process.returncode for process in started] == [0, 0], ends
    assert re.fullmatch(ONCE, "".join(ends).replace(f"{tmp_path}\n", ""))


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Iterator[Path]:
    """A cache of this test's own; packages that it imported are forgotten."""
    monkeypatch.setenv("NMPCRL_CACHE", str(tmp_path / "cache"))
    imported = set(sys.modules)
    yield tmp_path / "cache"
    for name in set(sys.modules) - imported:
        if re.search(r"^[a-z]+_[0-9a-f]{16}", name):
            del sys.modules[name]


def packages(cache: Path) -> list[Path]:
    return [path for path in cache.iterdir() if path.is_dir()]


def test_other_text_or_another_numba_is_other_code(cache, monkeypatch):
    texts = {"__init__": "from .part import x\n", "part": "x = 1\n"}
    assert jit.load("tiny", texts) is jit.load("tiny", texts)
    assert jit.load("tiny", texts | {"part": "x = 2\n"}).x == 2
    monkeypatch.setattr(jit, "version", lambda _: "0.1")
    assert jit.load("tiny", texts).x == 1
    assert len(packages(cache)) == 3


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        (TEXT + "\nraise KeyboardInterrupt('now')\n", KeyboardInterrupt, "now"),
        (TEXT + "\nfrom .part import missing\n", ImportError, "cannot import name 'missing'"),
        (TEXT.replace("2.0 * x", "x.y"), CannotCompile, "numba cannot compile stopped_"),
    ],
)
def test_what_cannot_be_imported_leaves_nothing(cache, capsys, text, error, words):
    with pytest.raises(error, match=words):
        jit.load("stopped", {"__init__": text, "part": ""})
    assert capsys.readouterr().err == ""
    assert not [*cache.rglob(jit.COMPLETE)]
    assert not [name for name in sys.modules if name.startswith("stopped_")]


def made_unfit(cache: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> str:
    """Make a cache unfit; the reason that is given."""
    if kind == "below a file":
        cache.touch()
        monkeypatch.setenv("NMPCRL_CACHE", str(cache / "below"))
        return f"{cache / 'below'}: Not a directory"
    if kind == "of another user":
        users, user = iter([-1]), os.getuid()
        monkeypatch.setattr(os, "getuid", lambda: next(users, user))
        return f"{cache} belongs to another user"
    if kind == "open to all":
        cache.mkdir()
        cache.chmod(0o707)
        return f"others may write to {cache}, which `chmod go-w` ends"
    step = {"full": "write", "filled by numba": "import_package"}[kind]  # which finds no room
    does = getattr(folder, step)

    def fails(place: Path, *given: Any) -> Any:
        if cache in place.parents:
            raise FULL
        return does(place, *given)

    monkeypatch.setattr(folder, step, fails)
    return f"{cache}: No space left on device"


@pytest.mark.parametrize(
    "kind", ["below a file", "of another user", "open to all", "full", "filled by numba"]
)
def test_what_an_unfit_folder_cannot_keep_a_temporary_one_does(cache, monkeypatch, capsys, kind):
    reason = made_unfit(cache, monkeypatch, kind)
    found = [jit.load(name, {"__init__": "x = 1\n"}) for name in ("first", "second")]
    assert capsys.readouterr().err == reason + ELSEWHERE
    (place,) = {Path(one.__file__).parent.parent for one in found}
    assert tempfile.gettempdir() == str(place.parent)
    assert os.environ["NMPCRL_CACHE"] == str(place)  # workers find it there
    assert not cache.is_dir() or not packages(cache)


def test_packages_are_the_users_alone_and_one_that_is_not_is_not_loaded(cache, capsys):
    texts = {"__init__": "x = 1\n"}
    found = jit.load("opened", texts)
    place = Path(found.__file__).parent
    assert place.parent == cache
    assert {one.stat().st_mode & 0o077 for one in (cache, place)} == {0}
    place.chmod(0o777)
    del sys.modules[found.__name__]
    assert not jit.load("opened", texts).__file__.startswith(str(cache))
    reason = f"others may write to {place}, which `chmod go-w` ends"
    assert capsys.readouterr().err == reason + ELSEWHERE
