"""The architecture: imports run one way, a foreign library has one home, departures are cited."""

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

from nmpcrl import control
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
        "control/solvers/hessian_times.py",
        "control/solvers/kernel.py",
        "control/solvers/plan_slopes.py",
        "control/solvers/rows.py",
        "control/solvers/rows_slopes.py",
        "control/solvers/rows_solve.py",
        "control/solvers/solve.py",
        "learning/network_rules.py",
        "learning/rules.py",
    ),
    "torch": "learning/network.py",
    "matplotlib": "report/figures",
}


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


def test_imports_run_one_way_from_commands_to_control():
    wrong = {}
    for path in MODULES:
        room = place(path).split("/")[0]
        imported = {name.split(".")[1] for name in imports(path) if name.startswith("nmpcrl.")}
        if room in ROOMS and (against := imported & set(ROOMS) - below(room)):
            wrong[place(path)] = against
    assert not wrong


def test_no_file_imports_itself_through_others():
    """Nor for its types alone; `prepare` raises `CycleError`, which names the files."""
    files = {f"nmpcrl.{place(path)[:-3].replace('/', '.')}": path for path in MODULES}
    TopologicalSorter({name: imports(path) & set(files) for name, path in files.items()}).prepare()


def test_storage_knows_no_experiment():
    """It runs any job and keeps any file, so it imports nothing of ours that lies outside it."""
    wrong = {
        place(path): outside
        for path in MODULES
        if place(path).startswith("study/storage/")
        if (
            outside := {
                name
                for name in imports(path)
                if name.startswith("nmpcrl.") and not name.startswith("nmpcrl.study.storage")
            }
        )
    }
    assert not wrong


def test_a_foreign_library_has_one_home():
    used = {place(path): {name.split(".")[0] for name in imports(path)} for path in MODULES}
    wrong = {
        path: library
        for path, libraries in used.items()
        for library in libraries & set(HOMES)
        if not path.startswith(HOMES[library])
    }
    assert not wrong


def test_only_the_study_knows_the_disk():
    """But for the cache of what numba compiled."""
    wrong = {}
    for path in MODULES:
        if place(path).startswith(("control/", "learning/")) and "codegen/" not in place(path):
            calls = [
                n.func for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Call)
            ]
            opened = {func.id for func in calls if isinstance(func, ast.Name)} & {"open"}
            if known := {name.split(".")[0] for name in imports(path)} & DISK | opened:
                wrong[place(path)] = known
    assert not wrong


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


def test_thresholds_and_the_controllers_face_are_asked_and_not_what_lies_behind_them():
    behind = {
        "claims/own_claims.py": "nmpcrl.claims.paper_claims",
        "report/live/problem.py": "nmpcrl.control.",
    }
    wrong = {
        path: found
        for path, inner in behind.items()
        if (found := {n for n in imports(ROOT / "nmpcrl" / path) if n.startswith(inner)})
        - {f"nmpcrl.control.{name}" for name in control.__all__}
    }
    assert not wrong
