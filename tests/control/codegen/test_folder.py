"""A disk that fails, or a folder that others may write to, changes where machine code is kept, and
nothing else: the same solver is compiled, and it says so in one sentence."""

import errno
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import nmpcrl
from nmpcrl.control.codegen import folder, jit
from nmpcrl.control.codegen.source import CannotCompile

IN_A_TEMPORARY_FOLDER = "; machine code is kept in a temporary folder until this process ends"
IN_MEMORY = "; machine code is kept in memory until this process ends"


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Iterator[Path]:
    """A cache of this test's own, of which nothing has been said."""
    monkeypatch.setenv("NMPCRL_CACHE", str(tmp_path / "cache"))
    folder._say.cache_clear()
    imported = set(sys.modules)
    yield tmp_path / "cache"
    for name in set(sys.modules) - imported:
        if re.search(r"^[a-z]+_[0-9a-f]{16}", name):
            del sys.modules[name]


def package(*, text: str = "", full: str = "False") -> dict[str, str]:
    """A package for whose import the disk is full where a condition on `place` holds."""
    raised = f'raise OSError({errno.ENOSPC}, "No space left on device")'
    return {"__init__": f'place = globals().get("__file__", "")\nif {full}:\n    {raised}\n{text}'}


# Each makes the cache unfit, and returns the reason that is given.


def a_file(cache: Path, _: pytest.MonkeyPatch) -> str:
    cache.touch()
    return f"{cache}: File exists"


def below_a_file(cache: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    cache.touch()
    monkeypatch.setenv("NMPCRL_CACHE", str(cache / "below"))
    return f"{cache / 'below'}: Not a directory"


def read_only(cache: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    may = os.access
    monkeypatch.setattr(os, "access", lambda place, how: place != cache and may(place, how))
    return f"{cache} cannot be written"


def of_another_user(cache: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    cache.mkdir(mode=0o700)
    owner, stat = cache.stat().st_uid, Path.stat

    def told(place: Path, **options: bool) -> os.stat_result:
        about = list(stat(place, **options))
        return os.stat_result([*about[:4], owner + (place == cache), *about[5:]])

    monkeypatch.setattr(Path, "stat", told)
    return f"{cache} belongs to another user"


def open_to(mode: int) -> Callable[[Path, pytest.MonkeyPatch], str]:
    def unfit(cache: Path, _: pytest.MonkeyPatch) -> str:
        cache.mkdir()
        cache.chmod(mode)
        return f"others may write to {cache}, which `chmod go-w` ends"

    return unfit


def full(cache: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    write = Path.write_bytes

    def fails(path: Path, content: bytes) -> int:
        if cache in path.parents:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", fails)
    return f"{cache}: No space left on device"


@pytest.mark.parametrize(
    "unfit",
    [a_file, below_a_file, read_only, of_another_user, open_to(0o770), open_to(0o707), full],
)
def test_what_an_unfit_folder_cannot_keep_a_temporary_one_does(cache, monkeypatch, capsys, unfit):
    reason = unfit(cache, monkeypatch)
    first, second = jit.load("first", package()), jit.load("second", package())
    assert capsys.readouterr().err.splitlines() == [reason + IN_A_TEMPORARY_FOLDER]
    places = [Path(found.place) for found in (first, second)]
    assert len({place.parent.parent for place in places}) == 1
    assert tempfile.gettempdir() == str(places[0].parent.parent.parent)
    assert os.environ["NMPCRL_CACHE"] == str(places[0].parent.parent)  # workers find it there
    assert not cache.is_dir() or not [*cache.iterdir()]


def test_a_disk_that_numba_fills_is_left_for_a_temporary_folder(cache, capsys):
    found = jit.load("numbas", package(full=f"place.startswith({str(cache)!r})"))
    assert not found.place.startswith(str(cache))
    reason = f"{cache}: No space left on device"
    assert capsys.readouterr().err.splitlines() == [reason + IN_A_TEMPORARY_FOLDER]
    assert not [*cache.rglob(jit.COMPLETE)]


def test_where_no_folder_can_be_had_code_is_compiled_in_memory(cache, monkeypatch, capsys):
    def nowhere(**_: object) -> str:
        raise FileNotFoundError(errno.ENOENT, "No usable temporary directory found")

    cache.touch()
    monkeypatch.setattr(tempfile, "mkdtemp", nowhere)
    texts = {"__init__": "from .part import x\n", "part": "x = 1\n"}
    assert jit.load("memory", texts).x == 1
    assert jit.load("other", package()).place == ""
    assert capsys.readouterr().err.splitlines() == [
        f"{cache}: File exists{IN_A_TEMPORARY_FOLDER}",
        f"{cache}: No usable temporary directory found{IN_MEMORY}",
    ]
    assert not [finder for finder in sys.meta_path if "_Texts" in repr(finder)]


def test_the_folder_and_what_is_in_it_are_the_users_alone(cache):
    place = Path(jit.load("mine", package()).place).parent
    assert place.parent == cache
    assert {one.stat().st_mode & 0o077 for one in (cache, place)} == {0}


def test_a_package_that_others_may_write_to_is_not_loaded(cache, capsys):
    texts = package(text="x = 1\n")
    found = jit.load("opened", texts)
    place = Path(found.place).parent
    place.chmod(0o777)
    del sys.modules[found.__name__]
    assert not jit.load("opened", texts).place.startswith(str(cache))
    reason = f"others may write to {place}, which `chmod go-w` ends"
    assert capsys.readouterr().err.splitlines() == [reason + IN_A_TEMPORARY_FOLDER]


def test_rights_are_not_asked_where_a_mode_tells_none(cache, monkeypatch):
    cache.mkdir()
    cache.chmod(0o777)
    monkeypatch.delattr(os, "getuid")
    assert jit.load("windows", package()).place.startswith(str(cache))


def test_a_package_that_is_changed_while_it_is_imported_is_compiled_elsewhere(cache, capsys):
    emptied = f"""
from pathlib import Path
if {str(cache)!r} in __file__:
    Path(__file__).with_name("part.py").write_text("")
from .part import x
"""
    assert jit.load("disturbed", {"__init__": emptied, "part": "x = 1\n"}).x == 1
    (said,) = capsys.readouterr().err.splitlines()
    assert said.endswith(" was changed while it was compiled" + IN_A_TEMPORARY_FOLDER)
    assert not [*cache.iterdir()]


def test_texts_that_do_not_fit_each_other_are_an_error_and_no_reason_for_another_solver(cache):
    texts = {"__init__": "from .part import missing\n", "part": ""}
    with pytest.raises(RuntimeError, match=r"do not fit each other \(cannot import name 'missing'"):
        jit.load("misfits", texts)
    assert not [name for name in sys.modules if name.startswith("misfits_")]


def test_what_numba_refuses_cannot_be_compiled_wherever_it_is_kept(cache, capsys):
    text = "from numba import njit, float64\n@njit(float64(float64))\ndef f(x):\n    return x.y\n"
    with pytest.raises(CannotCompile, match="numba cannot compile refused_"):
        jit.load("refused", {"__init__": text})
    assert capsys.readouterr().err == ""
    assert not [*cache.iterdir()]


# In processes of their own

SUMMED = """
import resource, sys
from nmpcrl.control.codegen import jit
resource.setrlimit(resource.RLIMIT_FSIZE, (2_000, 2_000))
text = '''
from numba import float64, int64, njit

@njit(float64(int64), cache=True)
def summed(n):
    total = 0.0
    for i in range(1, n):
        total += 1.0 / i
    return total
'''
found = jit.load("summed", {"__init__": text}, notice="Compiling a sum")
print(found.summed(100).hex())
"""


@pytest.mark.slow
def test_where_no_file_can_grow_code_is_compiled_in_memory_with_the_same_bits(tmp_path):
    """The text of a package still fits, and what numba makes of it does not."""
    cache = tmp_path / "cache"
    ended = subprocess.run(
        [sys.executable, "-W", "error", "-c", SUMMED],
        capture_output=True,
        text=True,
        env=os.environ | {"NMPCRL_CACHE": str(cache), "TMPDIR": str(tmp_path)},
    )
    assert ended.stdout.split() == [sum(1.0 / i for i in range(1, 100)).hex()], ended.stderr
    first, second, compiled = ended.stderr.splitlines()
    assert first == f"{cache}: File too large{IN_A_TEMPORARY_FOLDER}"
    assert second.endswith(f": File too large{IN_MEMORY}")
    assert compiled.startswith("Compiling a sum")
    assert [*tmp_path.iterdir()] == [cache]
    assert not [*cache.iterdir()]


EDITED = """
import sys
from pathlib import Path
import numpy as np
from nmpcrl.study import paper
import nmpcrl.control.solvers.riccati as riccati
(Path(riccati.__file__).parent / "kernel.py").write_text("from .model import missing")
print(paper.nmpc().solve(np.array(paper.START), np.array(paper.THETA_INIT)).solver)
"""


@pytest.mark.slow
def test_sources_that_are_edited_under_a_running_process_change_nothing_in_it(tmp_path):
    shutil.copytree(Path(nmpcrl.__file__).parent, tmp_path / "nmpcrl")
    ended = subprocess.run(
        [sys.executable, "-W", "error", "-c", EDITED],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
    )
    assert ended.stdout.strip() == "riccati", ended.stderr
