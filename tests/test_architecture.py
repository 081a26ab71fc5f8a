"""The architecture: imports keep the contracts of pyproject.toml, departures are cited."""

import re
from pathlib import Path

from importlinter.cli import lint_imports

from nmpcrl.study.departures import DEPARTURES

ROOT = Path(__file__).resolve().parent.parent
MODULES = sorted((ROOT / "nmpcrl").rglob("*.py"))


def test_imports_keep_their_contracts_control_and_learning_open_no_file_nothing_is_unpickled(
    monkeypatch, capsys
):
    monkeypatch.chdir(ROOT)
    monkeypatch.syspath_prepend(ROOT / "book")  # the driver
    assert lint_imports(no_cache=True, no_logo=True) == 0, capsys.readouterr().out
    paths = [*ROOT.glob("nmpcrl/control/**/*.py"), *ROOT.glob("nmpcrl/learning/**/*.py")]
    for path in paths:
        assert "codegen" in path.parts or not re.search(r"(?<![\w.])open\(", path.read_text()), path
    for path in MODULES:
        loads = re.findall(r"\bnp\.load\((.*)", path.read_text())
        assert all("allow_pickle=False" in one for one in loads), path


def cited(text: str) -> set[str]:
    """The letters in `# departure A`, `departures B and C`, `{ref}`departure-D``."""
    groups = re.findall(r"\bdepartures?[ -]([A-Z](?:(?:, | and )[A-Z])*)\b", text)
    return {letter for group in groups for letter in re.findall(r"[A-Z]", group)}


def test_departures_are_lettered_and_each_is_cited_where_it_is_made():
    pages = [*(ROOT / "book").glob("*.md"), *(ROOT / "book").glob("*.ipynb")]
    paths = [path for path in MODULES + sorted(pages) if path.name != "departures.py"]
    assert list(DEPARTURES) == [chr(ord("A") + i) for i in range(len(DEPARTURES))]
    assert set().union(*(cited(path.read_text()) for path in paths)) == set(DEPARTURES)
