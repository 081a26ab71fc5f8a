"""The changelog names what is there, and nothing that was there before."""

import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

TEXT = (Path(__file__).resolve().parents[1] / "CHANGELOG.md").read_text()
ROWS = re.findall(r"^\| (`.*) \| (`.*|the same in `.*`) \|$", TEXT, flags=re.M)
DOTTED = r"`([a-z_]+(?:\.\w+)+)`"


def is_module(name: str) -> bool:
    """Whether the package has a module of this name."""
    try:
        return find_spec(f"nmpcrl.{name}") is not None
    except ModuleNotFoundError:
        return False


def is_there(name: str) -> bool:
    """Whether it has a module of this name, or a module that holds it."""
    place, _, last = name.rpartition(".")
    return is_module(name) or (is_module(place) and hasattr(import_module(f"nmpcrl.{place}"), last))


@pytest.mark.parametrize(("old", "new"), ROWS)
def test_a_new_name_is_there_and_the_old_one_is_gone(old, new):
    before, after = re.findall(DOTTED, old), re.findall(DOTTED, new)
    if new.startswith("the same in"):
        (room,) = re.findall(r"`([\w.]+)`", new)
        after = [f"{room}.{name.rpartition('.')[2]}" for name in before]
    assert [name for name in after if not is_there(name)] == []
    assert [name for name in before if is_module(name) and name not in after] == []


def test_there_are_rows():
    assert len(ROWS) > 40
