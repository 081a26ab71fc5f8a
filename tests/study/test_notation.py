"""What the reference pages say of the code is so."""

import re
from importlib import import_module
from pathlib import Path

import build
import pytest

from nmpcrl.study.paper import DEPARTURES

ROOT = Path(__file__).resolve().parents[2]
NOTATION = (ROOT / "book/notation.md").read_text()
PACKAGES = ("control", "learning", "study")
MODULES = {path.stem: path for name in PACKAGES for path in (ROOT / "nmpcrl" / name).glob("*.py")}

ROWS = re.findall(r"^\| \((\d+)([a-f]?)\) \| (.*) \| (.*) \|$", NOTATION, flags=re.M)
FUNCTIONS = sorted({name for *_, cell in ROWS for name in re.findall(r"`([\w.]+)`", cell)})


def find(name: str) -> object:
    """What `module.name` or `module.Class.name` stands for."""
    module, *rest = name.split(".")
    path = MODULES[module].relative_to(ROOT).with_suffix("")
    found: object = import_module(".".join(path.parts))
    for part in rest:
        found = getattr(found, part)
    return found


def test_every_equation_of_the_paper_has_a_row_in_its_order():
    numbers = [int(number) for number, letter, *_ in ROWS if not letter]
    assert numbers == list(range(1, 21))
    assert [letter for number, letter, *_ in ROWS if letter] == list("abcdef")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_named_beside_an_equation_exists(name):
    assert find(name) is not None


@pytest.mark.parametrize("name", ["sensitivity.Sensitivity.value_and_gradient", "training.train"])
def test_the_functions_named_below_the_table_exist(name):
    assert f"`{name}`" in NOTATION
    assert callable(find(name))


def test_every_departure_has_a_section_that_renders_it():
    text = (ROOT / "book/departures.ipynb").read_text()
    assert re.findall(r"\(departure-([A-Z])\)=", text) == list(DEPARTURES)
    assert re.findall(r"cards\.departure\(\\\"([A-Z])\\\"\)", text) == list(DEPARTURES)


def test_the_parameters_of_the_chapters_are_those_that_they_declare():
    text = (ROOT / "book/reproduce.md").read_text()
    rows = re.findall(r"^\| `(\d\d_\w+|solver|performance)` \| (.*) \|$", text, flags=re.M)
    told = {chapter: re.findall(r"`(\w+)`", cell) for chapter, cell in rows}
    declared = {name: build.parameters(ROOT / path) for name, path in build.notebooks().items()}
    assert told == {name: parameters for name, parameters in declared.items() if parameters}
