"""What SECURITY.md promises of the code: nothing is unpickled, and no other machine is called."""

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
UNPICKLERS = {"cloudpickle", "dill", "joblib", "marshal", "pickle", "shelve"}
UNPICKLING = ("investigation.py", "jobs.py", "policy.py", "trial.py")
CALLERS = {"distributed", "ftplib", "http", "httpx", "requests", "smtplib", "socket", "urllib"}


@cache
def trees() -> dict[Path, ast.Module]:
    """What each module says."""
    paths = sorted((ROOT / "nmpcrl").rglob("*.py"))
    return {path: ast.parse(path.read_text()) for path in paths}


def imported(tree: ast.AST) -> set[str]:
    """The libraries that a module imports, in functions too."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add((node.module or "").split(".")[0])
    return names


def test_nothing_is_unpickled_but_answers_of_workers_trials_and_policies():
    for path, tree in trees().items():
        assert not imported(tree) & UNPICKLERS or path.name in UNPICKLING, path
        calls = [ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Call)]
        loads = [call for call in calls if call.startswith("np.load(")]
        assert all("allow_pickle=False" in load for load in loads), path


def test_only_a_cluster_is_connected_to():
    for path, tree in trees().items():
        assert not imported(tree) & CALLERS or path.name == "cluster.py", path
