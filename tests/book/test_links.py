"""The words of links are true: they name what is there, by the number that the page gives it."""

import re
from collections import Counter
from pathlib import Path

import nbformat
import pytest
import yaml
from bs4 import BeautifulSoup
from driver import project
from driver.page import enrich
from pybtex.database import parse_file
from pybtex.plugin import find_plugin
from pybtex.richtext import Text

from nmpcrl.claims import published
from nmpcrl.claims.paper_claims import CLAIMS
from nmpcrl.report import tables
from nmpcrl.study.departures import DEPARTURES

ROOT = Path(__file__).resolve().parents[2]
BIBLIOGRAPHY = parse_file(str(ROOT / "book/references.bib"))
PARTS = yaml.safe_load((ROOT / "_toc.yml").read_text())["parts"]
NUMBERED = [page["file"] for part in PARTS if part.get("numbered") for page in part["chapters"]]
CHAPTER = {Path(page).stem: number for number, page in enumerate(NUMBERED, 1)}
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


def authors(key: str) -> str:
    """As author and year name an entry: one name, two, or the first and others."""
    people = BIBLIOGRAPHY.entries[key].persons["author"]
    last = [str(Text.from_latex(" ".join(p.prelast_names + p.last_names))) for p in people]
    if len(last) > 2:
        return f"{last[0]} et al."
    return " and ".join(last)


def test_no_label_is_there_twice():
    labels = [label for page in LABELS.values() for label in page]
    assert sorted(labels) == sorted(set(labels))


@each_page
def test_every_link_leads_to_a_page_and_a_label_that_are_there(page):
    for words, target, label in links(page):
        assert not target or (ROOT / "book" / target).exists(), words
        assert not label or label in LABELS[Path(target).stem if target else page], words


def test_every_verdict_of_the_first_page_leads_to_its_evidence():
    verdicts = published.load().verdicts
    rows = BeautifulSoup(tables.plain_verdict_table(verdicts), "html.parser").select("tbody tr")
    led = {row.find("strong").get_text(): row.find("a")["href"].split("#") for row in rows}
    assert led.keys() == CLAIMS.keys()
    for claim, (page, label) in led.items():
        assert label == f"reviewers-{claim.lower()}"
        assert label in LABELS[Path(page).stem]


@each_page
def test_a_link_to_a_label_has_no_code_in_its_words_which_a_role_cannot_show(page):
    assert [words for words, _, label in links(page) if label and "`" in words] == []


@each_page
def test_equations_exercises_and_algorithms_are_numbered_in_their_order(page):
    for label, words in numbers(page).items():
        after = SOURCES[page].partition(f'<a id="{label}"></a>')[2]
        if label.startswith("eq-"):
            assert re.search(r"\\tag\{(.*?)\}", after)[1] == words[5:-1]
        else:
            assert after.startswith(f"\n**{words}.**")


@each_page
def test_what_is_numbered_is_called_by_its_number(page):
    for words, _, label in links(page):
        if label in WORDS:
            assert words == WORDS[label]
        if found := re.fullmatch(r"departure-([A-Z])", label):
            assert words in (found[1], f"departure {found[1]}")


@each_page
def test_a_chapter_is_called_by_its_number(page):
    for words, target, label in links(page):
        if found := re.fullmatch(r"Chapter (\d+)", words):
            assert CHAPTER[Path(target).stem] == int(found[1])
            assert not label


@each_page
def test_a_citation_says_who_and_when(page):
    for words, target, key in links(page):
        if target == "references.md":
            year = BIBLIOGRAPHY.entries[key].fields["year"]
            assert words in (f"{authors(key)} ({year})", f"({authors(key)}, {year})")


def test_the_page_of_references_has_what_is_cited_as_the_bibliography_has_it():
    cited = {key for page in SOURCES for _, to, key in links(page) if to == "references.md"}
    cited |= set(re.findall(r"references\.md#(\w+)", str(DEPARTURES)))
    assert set(LABELS["references"]) == cited
    style, backend = (
        find_plugin(f"pybtex.{kind}", name)()
        for kind, name in (("style.formatting", "alpha"), ("backends", "plaintext"))
    )
    entries = style.format_bibliography(BIBLIOGRAPHY, citations=sorted(cited))
    written = {entry.key: " ".join(entry.text.render(backend).split()) for entry in entries}
    listed = re.findall(r'^- <a id="(.*?)"></a>(.*)$', SOURCES["references"], flags=re.M)
    for key, text in listed:
        plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", text).replace("*", "")
        assert plain == written[key]


@each_page
def test_the_page_numbers_and_names_what_the_source_does(site, page):
    """Sphinx numbers and names by itself; so the words of a link are the same in both."""
    article = BeautifulSoup((site / f"book/{page}.html").read_text(), "html.parser").article
    shown = [" ".join(link.get_text().split()) for link in article.select("a[href]")]
    text = " ".join(article.get_text().split())
    for words, target, label in links(page):
        if target == "references.md":
            cited = re.sub(r"^\((.*)\)$", r"\1", words).replace("(", "[").replace(")", "]")
            assert cited in text
        elif label in WORDS:
            assert words in shown


def test_the_driver_knows_the_same_anchors():
    pattern = re.compile(enrich.ANCHOR)
    for page, labels in LABELS.items():
        assert [found["label"] for found in pattern.finditer(SOURCES[page])] == [
            label for label in labels if page != "references"
        ]
