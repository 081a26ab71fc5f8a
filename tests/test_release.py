"""What a release hands out, and what it says of itself."""

import importlib.util
import json
import re
import tomllib
from hashlib import sha256
from pathlib import Path
from zipfile import ZipFile

import pytest
import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
ABOUT = json.loads((ROOT / "codemeta.json").read_text())
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text())


@pytest.fixture(scope="module")
def release():
    """`release/make.py`, which runs in an environment of its own."""
    spec = importlib.util.spec_from_file_location("release_make", ROOT / "release/make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def built(tmp_path, release) -> Path:
    """A project in which everything was made that a release needs."""
    for place, names in (
        (release.SITE, ("index.html", "nmpcrl.pdf", "nmpcrl-article.pdf")),
        (release.SITE / "_downloads/course", ("student.zip", "slides.zip")),
        (release.COURSE, ("nmpcrl-1-py3-none-any.whl",)),
        (Path(), ("codemeta.json", "CITATION.cff")),
    ):
        (tmp_path / place).mkdir(parents=True, exist_ok=True)
        for name in names:
            (tmp_path / place / name).write_text(name)
    (tmp_path / release.TARGET).mkdir()
    return tmp_path


def test_a_release_has_the_wheel_the_book_the_papers_and_the_course(built, release):
    names = {path.name for path in release.gathered(built, built / release.TARGET)}
    assert {"nmpcrl-1-py3-none-any.whl", "nmpcrl-book.zip", "nmpcrl-article.pdf"} < names
    assert {"nmpcrl.pdf", "nmpcrl-student.zip", "nmpcrl-slides.zip", "codemeta.json"} < names
    with ZipFile(built / release.TARGET / "nmpcrl-book.zip") as book:
        assert "html/index.html" in book.namelist()
    for name in names:
        assert any(Path(name).match(pattern) for pattern in release.KINDS)


def test_every_file_of_a_release_has_its_hash(built, release):
    target = built / release.TARGET
    files = release.gathered(built, target)
    release.summed(target)
    lines = (target / "SHA256SUMS").read_text().splitlines()
    found = dict(reversed(line.split("  ")) for line in lines)
    assert found == {path.name: sha256(path.read_bytes()).hexdigest() for path in files}


def test_what_was_not_made_ends_a_release_in_a_sentence(built, release):
    (built / release.SITE / "nmpcrl.pdf").unlink()
    with pytest.raises(SystemExit, match=r"make book pdf article course.*nmpcrl\.pdf"):
        release.gathered(built, built / release.TARGET)


def test_the_tools_of_a_release_are_pinned_with_hashes():
    text = (ROOT / "release/tools.txt").read_text().replace("\\\n", "")
    pins = dict(re.findall(r"^([\w.-]+)==([\w.]+)", text, flags=re.M))
    lines = [line for line in text.splitlines() if re.match(r"[\w.-]+==", line)]
    assert all("--hash=sha256:" in line for line in lines)
    for line in (ROOT / "release/tools.in").read_text().splitlines()[1:]:
        asked = Requirement(line)
        assert pins[asked.name] == str(asked.specifier).removeprefix("==")


def test_codemeta_says_what_the_project_and_its_citation_say():
    (paper,) = CITATION["references"]
    assert ABOUT["name"] == PROJECT["name"]
    assert ABOUT["version"] == PROJECT["version"] == CITATION["version"]
    assert ABOUT["description"] == PROJECT["description"]
    assert ABOUT["license"].endswith(f"/{PROJECT['license']}")
    assert ABOUT["runtimePlatform"] == f"Python {PROJECT['requires-python']}"
    assert ABOUT["softwareRequirements"] == PROJECT["dependencies"]
    assert [one["name"] for one in ABOUT["author"]] == [one["name"] for one in CITATION["authors"]]
    based = ABOUT["isBasedOn"]
    assert (based["name"], based["@id"]) == (paper["title"], paper["url"])
    assert based["datePublished"] == str(paper["year"])
    keywords = yaml.safe_load((ROOT / "metadata.yaml").read_text())["keywords"]
    assert ABOUT["keywords"] == keywords.split(", ")
