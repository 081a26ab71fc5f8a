"""One list of pinned packages, and what all places agree on: the Pythons and the version."""

import re
import tomllib
from pathlib import Path

import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
REQUIRES = SpecifierSet(PROJECT["project"]["requires-python"])
PYTHONS = [python for python in (f"3.{minor}" for minor in range(50)) if python in REQUIRES]


def pins() -> list[Requirement]:
    lines = (ROOT / "environment.txt").read_text().splitlines()
    return [Requirement(line) for line in lines if line and not line.startswith("#")]


def versions(requirements: list[Requirement]) -> dict[str, str]:
    return {
        canonicalize_name(one.name): str(one.specifier).removeprefix("==") for one in requirements
    }


def test_every_package_is_pinned_once_to_one_version():
    for one in pins():
        assert re.fullmatch(r"==[\w.]+", str(one.specifier)), one
        assert not one.url, one
    names = [canonicalize_name(one.name) for one in pins()]
    assert len(names) == len(set(names))


def test_what_the_package_imports_is_pinned():
    project = PROJECT["project"]
    extras = project["optional-dependencies"].values()
    needed = {*project["dependencies"], *(name for extra in extras for name in extra)}
    needed = {name for name in needed if not name.startswith("nmpcrl[")}  # another extra
    assert set(map(canonicalize_name, needed)) <= set(versions(pins()))


def test_all_places_name_the_same_pythons():
    makefile = re.search(r"^PYTHONS := (.*)$", (ROOT / "Makefile").read_text(), flags=re.M)
    workflow = yaml.safe_load((ROOT / ".github/workflows/book.yml").read_text())
    assert makefile
    assert makefile[1].split() == PYTHONS
    assert workflow["jobs"]["pythons"]["strategy"]["matrix"]["python"] == PYTHONS
    assert PROJECT["tool"]["mypy"]["python_version"] == PYTHONS[0]
