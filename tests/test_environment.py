"""One list of pinned packages, the locks made of it, and the Pythons that all places agree on."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
REQUIRES = SpecifierSet(PROJECT["project"]["requires-python"])
PYTHONS = [python for python in (f"3.{minor}" for minor in range(50)) if python in REQUIRES]
LINUX = {"sys_platform": "linux", "platform_system": "Linux", "platform_machine": "x86_64"}
CUDA = re.compile(r"(cuda|nvidia)-.*|triton")  # what torch brings along on Linux, and no list names


def pins() -> list[Requirement]:
    lines = (ROOT / "environment.txt").read_text().splitlines()
    return [Requirement(line) for line in lines if line and not line.startswith("#")]


def versions(requirements: list[Requirement]) -> dict[str, str]:
    return {
        canonicalize_name(one.name): str(one.specifier).removeprefix("==") for one in requirements
    }


def locked(python: str) -> dict[str, list[str]]:
    """The entries of a lock: `name==version`, and the hashes of each."""
    text = (ROOT / f"locks/python{python}.txt").read_text().replace("\\\n", "")
    entries = [line.split() for line in text.splitlines() if not line.startswith("#")]
    return {name: hashes for name, *hashes in entries}


def test_every_package_is_pinned_once_to_one_version():
    for one in pins():
        assert re.fullmatch(r"==[\w.]+", str(one.specifier)), one
        assert not one.url, one
    names = [canonicalize_name(one.name) for one in pins()]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("python", PYTHONS)
def test_a_lock_names_the_versions_of_the_list_and_what_torch_brings(python):
    here = LINUX | {"python_version": python}
    wanted = versions([one for one in pins() if not one.marker or one.marker.evaluate(here)])
    found = versions([Requirement(name) for name in locked(python)])
    brought = {name for name in found if CUDA.fullmatch(name)}
    assert {name: found[name] for name in found if name not in brought} == wanted
    assert not brought & set(wanted)


@pytest.mark.parametrize("python", PYTHONS)
def test_every_package_of_a_lock_has_hashes_and_nothing_but_hashes(python):
    for name, hashes in locked(python).items():
        assert hashes, name
        assert all(re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", one) for one in hashes), name


def test_there_is_a_lock_for_each_python_and_no_other():
    assert {path.stem for path in (ROOT / "locks").glob("*.txt")} == {f"python{p}" for p in PYTHONS}


def test_what_the_package_imports_is_pinned():
    project = PROJECT["project"]
    extras = project["optional-dependencies"].values()
    needed = {*project["dependencies"], *(name for extra in extras for name in extra)}
    assert set(map(canonicalize_name, needed)) <= set(versions(pins()))


def test_all_places_name_the_same_pythons():
    makefile = re.search(r"^PYTHONS := (.*)$", (ROOT / "Makefile").read_text(), flags=re.M)
    workflow = yaml.safe_load((ROOT / ".github/workflows/book.yml").read_text())
    assert makefile
    assert makefile[1].split() == PYTHONS
    assert workflow["jobs"]["pythons"]["strategy"]["matrix"]["python"] == PYTHONS
    assert PROJECT["tool"]["mypy"]["python_version"] == PYTHONS[0]
