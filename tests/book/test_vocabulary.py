"""The field's word, once, in prose: words that this project used to have are not to come back."""

import ast
import re
from functools import cache
from pathlib import Path

import nbformat
import pytest
from driver.page import enrich

ROOT = Path(__file__).resolve().parents[2]
FIXED = {ROOT / "nmpcrl" / "studies" / "population.py"}  # its registered questions stay
NAMED = ("README.md", "CONTRIBUTING.md", "CITATION.cff")

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


NOTEBOOKS = {
    path.name: nbformat.read(path, 4).cells for path in sorted((ROOT / "book").glob("*.ipynb"))
}


def alternative(cell) -> str:
    """What describes a figure to whoever does not see it."""
    return cell.metadata.get("mystnb", {}).get("image", {}).get("alt", "")


def strings(code: str) -> list[str]:
    """The texts in code, docstrings included."""
    nodes = ast.walk(ast.parse(code))
    return [node.value for node in nodes if isinstance(getattr(node, "value", None), str)]


def said(cell) -> list[str]:
    """What a cell says."""
    return [cell.source] if cell.cell_type == "markdown" else strings(cell.source)


@cache
def prose() -> dict[str, str]:
    """What is written for readers, by file."""
    pages = [*(ROOT / name for name in NAMED), *(ROOT / "book").rglob("*.md")]
    found = {path.relative_to(ROOT).as_posix(): path.read_text() for path in pages}
    for path in {*(ROOT / "nmpcrl").rglob("*.py")} - FIXED:
        found[path.relative_to(ROOT).as_posix()] = "\n".join(strings(path.read_text()))
    for name, cells in NOTEBOOKS.items():
        texts = [text for cell in cells for text in said(cell)]
        found[name] = "\n".join([*texts, *map(alternative, cells)])
    return found


def finder(pattern: str) -> re.Pattern[str]:
    """Finds them as a part of a name, and not inside another word."""
    return re.compile(rf"(?<![a-zA-Z])(?:{pattern})(?![a-zA-Z])", re.IGNORECASE)


def found(better: str, text: str) -> list[str]:
    """The lines of a text with an old word, and not in a context that is allowed."""
    pattern, allowed = OLD[better]
    lines = re.sub(allowed or "$^", "", text, flags=re.IGNORECASE).splitlines()
    return [line.strip()[:120] for line in lines if finder(pattern).search(line)]


@pytest.mark.parametrize("better", OLD)
def test_an_old_word_is_gone(better):
    lines = [f"{name}: {line}" for name, text in prose().items() for line in found(better, text)]
    assert not lines, "\n".join([f'{len(lines)} times; say "{better}":', *lines])


def test_captions_and_alternative_texts_call_a_panel_by_its_title_or_letter():
    cells = [cell for cells in NOTEBOOKS.values() for cell in cells]
    captions = [cell.source for cell in cells if "caption" in cell.metadata.get("tags", [])]
    captions += filter(None, map(alternative, cells))
    assert len(captions) > 50
    assert [text for text in captions if finder(PLACES).search(text)] == []


@pytest.mark.parametrize(
    ("better", "text"),
    [
        ("trajectory", "the cheapest of these roads"),
        ("higher cost", "the dearest costs 13350"),
        ("has as an input", "The network is told theta"),
        ("the network predicts", "RDES asks its network"),
        ("is compared with", "each is held against the frozen arm"),
        ("theta_c", "θ_c grew"),
    ],
)
def test_an_old_word_is_found(better, text):
    assert found(better, text)


@pytest.mark.parametrize(
    "text",
    [
        "an assumption that does not hold is enough against it",
        "the fit of the network",
        "the differential drive, and its driver",
        "what is left of the time",
        "a share above 2",
    ],
)
def test_what_the_field_says_is_allowed(text):
    assert not any(found(better, text) for better in OLD)
    assert not finder(PLACES).search(text)


@pytest.mark.parametrize(
    "term",
    ["TD error", "Expected Sarsa", "bootstrap", "semi-gradient", "on-policy", "off-policy"],
)
def test_a_term_is_defined_in_the_paragraph_that_first_uses_it(term):
    read = [*NOTEBOOKS["01_mdp_and_nmpc.ipynb"], *NOTEBOOKS["02_expected_sarsa.ipynb"]]
    shown = [cell for cell in read if "goals" not in cell.metadata.get("tags", [])]
    texts = [text for cell in shown for text in said(cell)]
    paragraphs = re.sub(enrich.ANCHOR, "", "\n\n".join(texts)).split("\n\n")
    first = next(one for one in paragraphs if re.search(rf"(?<![\w-]){term}(?![\w-])", one, re.I))
    assert f"*{term}*" in first
