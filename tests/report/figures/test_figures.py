"""Figures share what is in four modules, and take nothing from each other."""

import ast
from pathlib import Path

import pytest

FIGURES = Path(__file__).resolve().parents[3] / "nmpcrl/report/figures"
SHARED = ("moving", "sheet", "style", "axes", "panels")  # each may use those before it
PACKAGE = "nmpcrl.report.figures."


@pytest.mark.parametrize("path", sorted(FIGURES.rglob("*.py")), ids=lambda path: path.stem)
def test_a_module_of_figures_imports_only_what_all_share(path):
    nodes = list(ast.walk(ast.parse(path.read_text())))
    imported = {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
    used = {name.removeprefix(PACKAGE) for name in imported if name.startswith(PACKAGE)}
    shared = SHARED[: SHARED.index(path.stem)] if path.stem in SHARED else SHARED
    assert used <= set(shared)
