"""The field's word, once: words that this project used to have are not to come back."""

import json
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES = ("README.md", "CONTRIBUTING.md", "CITATION.cff", "metadata.yaml", "Makefile")
FOLDERS = ("nmpcrl", "book", "tests")
KINDS = (".py", ".md", ".ipynb", ".css", ".js", ".html", ".svg")

OLD = {  # the word that replaces it: the pattern of the old one, and where it may stand
    "robustness analysis": (r"atlas(es)?", ""),
    "changes the verdict": (r"flip(s|ped|ping)?", ""),
    "failure mode": (r"fates?", ""),
    "perturbed replica": (r"twins?", ""),
    "run summary": (r"digests?", r"hexdigest"),
    "train": (r"harvest(s|ed|ing)?", ""),
    "baseline, default, common": (r"usual", ""),
    "trajectory": (r"roads?", ""),
    "rollout": (
        r"dr(ive|ives|iven|iving|ove)",
        r"data-driven|differential[ _]drive|driven wheels|robots?( that)? (drives?|drove)",
    ),
    "cost ratio": (r"excess(es)?", ""),
    "late cost range": (r"wander(s|ed|ing)?", ""),
    "warm start": (r"guess(es|ed)?", ""),
    "table": (r"cards?", ""),
    "higher cost": (r"dearer|costlier|dearest|costliest", ""),
    "lower cost": (r"cheap(er|est|ly)?", ""),
    "has theta as an input": (r"told (of )?theta", ""),
    "baseline": (r"rivals?", ""),
    "depends on": (r"hinges?", ""),
    "predicts": (r"networks? (says?|said)", ""),
}


def sources() -> list[Path]:
    """Every text of the project but this one and what is published."""
    inside = (path for folder in FOLDERS for path in (ROOT / folder).rglob("*"))
    kept = [path for path in inside if path.suffix in KINDS and path != Path(__file__).resolve()]
    kept = [path for path in kept if not {"published", "__pycache__"} & set(path.parts)]
    return sorted(kept) + [ROOT / name for name in FILES]


@cache
def text(path: Path) -> str:
    """What a reader sees of a file; of a notebook, its cells and what describes them."""
    if path.suffix != ".ipynb":
        return path.read_text()
    cells = json.loads(path.read_text())["cells"]
    parts = [[cell["id"], "".join(cell["source"]), *words(cell["metadata"])] for cell in cells]
    return "\n".join(part for cell in parts for part in cell)


def words(metadata: object) -> list[str]:
    """The texts in a cell's metadata: caption, alternative text, name, tags."""
    if isinstance(metadata, dict):
        return [word for value in metadata.values() for word in words(value)]
    if isinstance(metadata, list):
        return [word for value in metadata for word in words(value)]
    return [str(metadata)]


def found(pattern: str, allowed: str) -> list[str]:
    """Where an old word stands, also as a part of a name, and not in a context that is allowed."""
    old = re.compile(rf"(?<![a-zA-Z])(?:{pattern})(?![a-zA-Z])", re.IGNORECASE)
    lines = []
    for path in sources():
        kept = re.sub(allowed, "", text(path), flags=re.IGNORECASE) if allowed else text(path)
        hits = [line for line in kept.splitlines() if old.search(line)]
        lines += [f"{path.relative_to(ROOT)}: {line.strip()[:120]}" for line in hits]
    return lines


@pytest.mark.parametrize("better", OLD)
def test_an_old_word_is_gone(better):
    lines = found(*OLD[better])
    assert not lines, "\n".join([f'{len(lines)} times; say "{better}":', *lines])


def test_a_word_is_found_as_a_part_of_a_name_and_not_inside_another_word():
    pattern, allowed = OLD["rollout"]
    old = re.compile(rf"(?<![a-zA-Z])(?:{pattern})(?![a-zA-Z])", re.IGNORECASE)
    for name in ("first_drive", "Drives without noise"):
        assert old.search(name)
    for name in ("driver", "overdrive"):
        assert not old.search(name)
    assert not re.sub(allowed, "", "differential_drive")
