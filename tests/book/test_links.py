"""The words of links are true: they name what is there, by the number that the page gives it."""

import re
from collections import Counter
from pathlib import Path

import nbformat
import pytest
import yaml
from driver import project

from nmpcrl.claims.paper_claims import CLAIMS
from nmpcrl.study.departures import DEPARTURES

ROOT = Path(__file__).resolve().parents[2]
PARTS = yaml.safe_load((ROOT / "_toc.yml").read_text())["parts"]
NUMBERED = [page["file"] for part in PARTS if part.get("numbered") for page in part["chapters"]]
CHAPTER = {
    stem: int(stem[:2]) if stem[:2].isdigit() else number
    for number, stem in enumerate((Path(page).stem for page in NUMBERED), 1)
}
KINDS = {"eq": "Eq. ({})", "fig": "Fig. {}", "alg": "Algorithm {}", "ex": "Exercise {}"}

Link = tuple[str, str, str]  # words, page, label


def source(page: str) -> str:
    """What a reader of the source sees: all cells of a notebook."""
    path = next(ROOT.glob(f"{page}.*"))
    if path.suffix == ".md":
        return path.read_text()
    return "\n\n".join(cell.source for cell in nbformat.read(path, as_version=4).cells)


SOURCES = {Path(page).stem: source(page) for page in project.pages()}
# a label is one of what comes right below it
LABELS = {page: re.findall(r'<a id="([^"]+)"></a>(?!\n\n)', text) for page, text in SOURCES.items()}
each_page = pytest.mark.parametrize("page", SOURCES)


def links(page: str) -> list[Link]:
    """The links between pages of the book, and within one."""
    # in a call of `say` a link may be broken between two lines
    text = re.sub(r"\n +", " ", SOURCES[page])
    found = re.findall(r"\[([^][]+)\]\(([\w.-]*)(?:#([\w:-]+))?\)", text)
    return [(words, target, label) for words, target, label in found if target or label]


def numbers(page: str) -> dict[str, str]:
    """The words for each numbered label of a page, in its order."""
    count: Counter[str] = Counter()
    words = {}
    for label in LABELS[page]:
        kind = re.match(r"[a-z]+", label)[0]
        if kind in KINDS:
            count[kind] += 1
            of_chapter = f"{CHAPTER[page]}." if page in CHAPTER else ""
            words[label] = KINDS[kind].format(f"{of_chapter}{count[kind]}")
    return words


WORDS = {label: words for page in SOURCES for label, words in numbers(page).items()}


def test_no_label_is_there_twice():
    labels = [label for page in LABELS.values() for label in page]
    assert sorted(labels) == sorted(set(labels))


@each_page
def test_every_link_leads_to_a_page_and_a_label_that_are_there(page):
    for words, target, label in links(page):
        assert not target or (ROOT / "book" / target).exists(), words
        assert not label or label in LABELS[Path(target).stem if target else page], words


def test_every_claim_has_its_evidence():
    assert {f"evidence-{claim.lower()}" for claim in CLAIMS} <= {*LABELS["evidence"]}


@each_page
def test_equations_exercises_and_algorithms_are_numbered_in_their_order(page):
    for label, words in numbers(page).items():
        after = SOURCES[page].partition(f'<a id="{label}"></a>')[2]
        if label.startswith("eq-"):
            assert re.search(r"\\tag\{(.*?)\}", after)[1] == words[5:-1]
        else:
            assert after.startswith(f"\n**{words}.**")


ENTRIES = dict(re.findall(r'^- <a id="(.*?)"></a>(.*)$', SOURCES["references"], flags=re.M))


@each_page
def test_what_is_numbered_and_a_chapter_are_called_by_their_number_and_a_citation_by_who_and_when(
    page,
):
    for words, target, label in links(page):
        if label in WORDS:
            assert words == WORDS[label]
        if found := re.fullmatch(r"departure-([A-Z])", label):
            assert words.split()[-1] == found[1]
        if found := re.fullmatch(r"Chapter (\d+)", words):
            assert (CHAPTER[Path(target).stem], label) == (int(found[1]), "")
        if target == "references.md":
            first, year = re.match(r"\(?(.+?)(?: and | et al\.|,| \().*?(\d{4})", words).groups()
            assert first in ENTRIES[label]
            assert year in ENTRIES[label]


def test_the_page_of_references_has_what_is_cited():
    cited = {key for page in SOURCES for _, to, key in links(page) if to == "references.md"}
    cited |= set(re.findall(r"references\.md#(\w+)", str(DEPARTURES)))
    assert set(ENTRIES) == cited
