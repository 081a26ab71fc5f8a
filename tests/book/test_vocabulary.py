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
    "has as an input": (
        r"told (of )?theta|tells? (its|the|a) networks?|networks? (is|are|was|were|be) told",
        "",
    ),
    "the network predicts": (
        r"networks? (says?|said|answers?|answered)|ask(s|ed|ing)? (its|the|a|that) networks?",
        "",
    ),
    "baseline, other": (r"rivals?", ""),
    "depends on": (r"hinges?|hangs? on", ""),
    "captures": (r"knows? only", ""),
    "is compared with": (
        r"(held|holding) ([\w'`]+ ){0,3}against"
        r"|holds? (it|them|all|each|one|two|your|their|a)( [\w'`]+){0,3} against",
        "",
    ),
    "is excluded, is undecidable": (r"(is|as) no answer", ""),
    "is easy to miss": (r"nobody notices", ""),
    "is selected automatically": (r"nobody chose", ""),
    "target": (r"figures? to reach", ""),
    "straight line": (r"straight way", ""),
    "chance": (r"luck(y|ily)?", ""),
    "correct": (r"mend(s|ed|ing)?", ""),
    "three times": (r"thrice", ""),
    "theta_c": (r"θ_\w*|θc|vartheta_c|theta_\{c\}", ""),  # in text; in formulas \\theta_c
}

PLACES = (  # of a panel: on a telephone the panels are stacked
    r"(left|right|middle|top|bottom|upper|lower)(most)? (panels?|columns?|rows?|half|plots?)"
    r"|(left|right)-hand"
    r"|(on|at|to) the (left|right|top|bottom)"
    r"|(?-i:Left|Right|Middle|Top|Bottom|Above|Below|Centre)( and \w+)?[:,]"
)


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


def finder(pattern: str) -> re.Pattern[str]:
    """Finds them as a part of a name, and not inside another word."""
    return re.compile(rf"(?<![a-zA-Z])(?:{pattern})(?![a-zA-Z])", re.IGNORECASE)


def without(allowed: str, text: str) -> str:
    return re.sub(allowed, "", text, flags=re.IGNORECASE) if allowed else text


def found(pattern: str, allowed: str) -> list[str]:
    """Where an old word stands, and not in a context that is allowed."""
    old, lines = finder(pattern), []
    for path in sources():
        hits = [line for line in without(allowed, text(path)).splitlines() if old.search(line)]
        lines += [f"{path.relative_to(ROOT)}: {line.strip()[:120]}" for line in hits]
    return lines


def captions() -> list[tuple[str, str]]:
    """Every caption and alternative text of the notebooks, with where it stands."""
    found = []
    for path in sorted((ROOT / "book").glob("*.ipynb")):
        for cell in json.loads(path.read_text())["cells"]:
            place = f"{path.name}: {cell['id']}"
            if "caption" in cell["metadata"].get("tags", []):
                found.append((place, "".join(cell["source"])))
            if alt := cell["metadata"].get("mystnb", {}).get("image", {}).get("alt"):
                found.append((place, alt))
    return found


@pytest.mark.parametrize("better", OLD)
def test_an_old_word_is_gone(better):
    lines = found(*OLD[better])
    assert not lines, "\n".join([f'{len(lines)} times; say "{better}":', *lines])


def test_a_word_is_found_as_a_part_of_a_name_and_not_inside_another_word():
    pattern, allowed = OLD["rollout"]
    old = finder(pattern)
    for name in ("first_drive", "Drives without noise"):
        assert old.search(name)
    for name in ("driver", "overdrive"):
        assert not old.search(name)
    assert not re.sub(allowed, "", "differential_drive")


def test_captions_and_alternative_texts_call_a_panel_by_its_title_or_letter():
    place, found = finder(PLACES), captions()
    assert len(found) > 50
    lines = [f"{where}: ...{hit[0]}..." for where, text in found if (hit := place.search(text))]
    assert not lines, "\n".join(lines)


@pytest.mark.parametrize(
    ("better", "text"),
    [
        ("trajectory", "the cheapest of these roads"),
        ("higher cost", "the dearest costs 13350"),
        ("has as an input", "The network is told theta"),
        ("the network predicts", "RDES asks its network"),
        ("is compared with", "Hold your runs against ours"),
        ("is compared with", "each is held against the frozen arm"),
        ("theta_c", "θ_c grew"),
    ],
)
def test_the_sentences_that_this_list_was_made_from_are_found(better, text):
    pattern, _ = OLD[better]
    assert finder(pattern).search(text)


@pytest.mark.parametrize(
    "text",
    [
        "an assumption that does not hold is enough against it",
        "the fit of the network",
        "the differential drive",
        "what is left of the time",
        "a share above 2",
    ],
)
def test_what_the_field_says_is_allowed(text):
    for pattern, allowed in OLD.values():
        assert not finder(pattern).search(without(allowed, text))
    assert not finder(PLACES).search(text)
