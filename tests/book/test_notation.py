"""What the reference pages say of the code is so."""

import ast
import re
import shlex
from importlib import import_module
from pathlib import Path

import nbformat
import pytest
from driver import project
from driver.build import chapters

from nmpcrl.commands import main
from nmpcrl.report import prose
from nmpcrl.study.departures import DEPARTURES

ROOT = Path(__file__).resolve().parents[2]
NOTATION = (ROOT / "book/notation.md").read_text()
REPRODUCE = (ROOT / "book/reproduce.md").read_text()
MODULES: dict[str, list[Path]] = {}  # by name; two rooms may have one of the same
for path in sorted((ROOT / "nmpcrl").rglob("*.py")):
    MODULES.setdefault(path.stem, []).append(path)

ROWS = re.findall(r"^\| \((\d+)([a-f]?)\) \| (.*) \| (.*) \|$", NOTATION, flags=re.M)
ADDED = NOTATION.partition("## Equations that the paper does not have\n")[2]
ADDED_ROWS = re.findall(r"^\| (?!what it is|-)(.*) \| (.*) \|$", ADDED, flags=re.M)
CELLS = [cell for *_, cell in ROWS + ADDED_ROWS]
FUNCTIONS = sorted({name for cell in CELLS for name in re.findall(r"`([\w.]+)`", cell)})


def find(name: str) -> object:
    """What `module.name` or `module.Class.name` stands for."""
    module, *rest = name.split(".")
    for path in MODULES[module]:
        found: object = import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
        for part in rest:
            found = getattr(found, part, None)
        if found is not None:
            return found
    return None


def test_every_equation_of_the_paper_has_a_row_in_its_order():
    numbers = [int(number) for number, letter, *_ in ROWS if not letter]
    assert numbers == list(range(1, 21))
    assert [letter for number, letter, *_ in ROWS if letter] == list("abcdef")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_named_beside_an_equation_exists(name):
    assert find(name) is not None


def defined(text: str) -> set[str]:
    """The public functions at the top of a module."""
    tree = ast.parse(text)
    return {
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
    }


@pytest.mark.parametrize("module", ["updates", "baselines"])
def test_every_update_and_every_control_is_beside_an_equation(module):
    text = (ROOT / f"nmpcrl/learning/{module}.py").read_text()
    assert {f"{module}.{name}" for name in defined(text)} <= set(FUNCTIONS)


def test_every_departure_has_a_section_and_chapters_the_parameters_that_they_declare():
    text = (ROOT / "book/departures.ipynb").read_text()
    assert re.findall(r'<a id=\\"departure-([A-Z])\\"', text) == list(DEPARTURES)
    assert re.findall(r"tables\.departure\(\\\"([A-Z])\\\"\)", text) == list(DEPARTURES)
    rows = re.findall(r"^\| `(\d\d_\w+|solver)` \| (.*) \|$", REPRODUCE, flags=re.M)
    listed = {chapter: re.findall(r"`(\w+)`", cell) for chapter, cell in rows}
    declared = {
        name: chapters.parameters(ROOT / path) for name, path in project.notebooks().items()
    }
    assert listed == {name: parameters for name, parameters in declared.items() if parameters}


def blocks(language: str, page: str = REPRODUCE) -> list[str]:
    """The code of a page, by default of the one on commands, in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", page, flags=re.M | re.S)


def commands() -> list[list[str]]:
    """The lines that call `nmpcrl`, each split as a shell would."""
    lines = [line for block in blocks("bash") for line in block.splitlines()]
    return [shlex.split(line)[1:] for line in lines if line.startswith("nmpcrl ")]


@pytest.mark.parametrize("words", commands(), ids=" ".join)
def test_the_commands_that_the_page_shows_are_accepted(words):
    name, *rest = words
    with main.make_context("nmpcrl", words) as context:
        main.commands[name].make_context(name, rest, context)


@pytest.mark.parametrize("table", ["table-1", "text-numbers"])
def test_a_number_that_is_not_the_papers_has_a_departure(table, monkeypatch):
    page = nbformat.read(ROOT / "book/departures.ipynb", as_version=4)
    cells, names, shown = {cell.id: cell.source for cell in page.cells}, {}, []
    monkeypatch.setattr(prose, "_show", shown.append)
    for cell in ("table-1-numbers", "text-numbers", f"{table}-said"):
        exec(cells[cell], names)
    rows = [line[1:-1].split("|") for line in shown[0].splitlines() if line.startswith("|")][2:]
    assert len(rows) == 9
    for what, printed, here, differs in rows:
        same = printed.replace(r"$\pi/2$", "1.571").replace(" m,", ",").strip() == here.strip()
        assert same or "#departure-" in differs, what
