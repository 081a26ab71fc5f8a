"""The architecture: imports run one way, a foreign library has one home, departures are cited."""

import ast
import re
from pathlib import Path

import pytest

from nmpcrl.study.departures import DEPARTURES

ROOT = Path(__file__).resolve().parent.parent
MODULES = sorted((ROOT / "nmpcrl").rglob("*.py"))
ROOMS = {  # each may import those that it names, and what they may
    "control": (),
    "learning": ("control",),
    "study": ("learning",),
    "analysis": ("study",),
    "bench": ("study",),
    "claims": ("analysis", "bench"),
    "report": ("claims",),
    "course": ("claims",),
    "commands": ("report", "course"),
}
DISK = {"io", "json", "os", "pathlib", "pickle", "shutil", "sqlite3", "tempfile"}
HOMES = {  # foreign library -> where alone it may be imported
    "casadi": "control/",
    "numba": (
        "control/solvers/entries.py",
        "control/solvers/hessian.py",
        "control/solvers/kernel.py",
        "learning/network_rules.py",
        "learning/rules.py",
    ),
    "torch": "learning/network.py",
    "matplotlib": "report/figures",
}

each_module = pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))


def place(path: Path) -> str:
    return path.relative_to(ROOT / "nmpcrl").as_posix()


def imports(path: Path) -> set[str]:
    """Every module a file imports, functions' own imports included, in absolute names."""
    package = path.relative_to(ROOT).parent.parts
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else ()
            base = ".".join([*above, *([node.module] if node.module else [])])
            names |= {base} | {f"{base}.{alias.name}" for alias in node.names}
    return names


def cited(text: str) -> set[str]:
    """The letters in `# departure A`, `departures B and C`, `{ref}`departure-D``."""
    groups = re.findall(r"\bdepartures?[ -]([A-Z](?:(?:, | and )[A-Z])*)\b", text)
    return {letter for group in groups for letter in re.findall(r"[A-Z]", group)}


def below(room: str) -> set[str]:
    """The rooms that a room may import, directly or through others."""
    return {room}.union(*map(below, ROOMS[room]))


def test_every_module_is_in_a_room():
    places = {place(path).split("/")[0] for path in MODULES}
    assert places == {*ROOMS, "__init__.py", "__main__.py"}


@each_module
def test_imports_run_one_way_from_commands_to_control(path):
    room = place(path).split("/")[0]
    imported = {name.split(".")[1] for name in imports(path) if name.startswith("nmpcrl.")}
    if room in ROOMS:
        assert imported & set(ROOMS) <= below(room)


@each_module
@pytest.mark.parametrize("library", HOMES)
def test_a_foreign_library_has_one_home(path, library):
    used = any(name.split(".")[0] == library for name in imports(path))
    assert not used or place(path).startswith(HOMES[library])


@each_module
def test_only_the_study_knows_the_disk(path):
    if place(path).split("/")[0] not in ("control", "learning"):
        return
    if place(path).startswith("control/codegen/"):  # its cache of what numba compiled
        return
    calls = [
        node.func for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)
    ]
    assert not {name.split(".")[0] for name in imports(path)} & DISK
    assert not [func for func in calls if isinstance(func, ast.Name) and func.id == "open"]


def test_departures_are_lettered_without_a_gap():
    assert list(DEPARTURES) == [chr(ord("A") + i) for i in range(len(DEPARTURES))]


def where_departures_are_cited() -> list[Path]:
    pages = [*(ROOT / "book").glob("*.md"), *(ROOT / "book").glob("*.ipynb")]
    return [path for path in MODULES + sorted(pages) if path.name != "departures.py"]


def test_every_departure_is_cited_where_it_is_made():
    texts = [path.read_text() for path in where_departures_are_cited()]
    assert set(DEPARTURES) <= set().union(*map(cited, texts))


def test_every_citation_of_a_departure_exists():
    for path in where_departures_are_cited():
        assert cited(path.read_text()) <= set(DEPARTURES), path
