"""The page "Paper and book" has every item of the paper, and its numbers are the library's."""

import re
from pathlib import Path

import nbformat
import pytest

from nmpcrl.claims import published
from nmpcrl.claims.paper_claims import CLAIMS
from nmpcrl.report import prose
from nmpcrl.study.departures import DEPARTURES

ROOT = Path(__file__).resolve().parents[2]
CELLS = {
    cell.id: cell.source for cell in nbformat.read(ROOT / "book/paper_and_book.ipynb", 4).cells
}
PAGE = "\n\n".join(CELLS.values())
NOTATION = (ROOT / "book/notation.md").read_text()
EQUATIONS = re.findall(r"^\| (\(\d+[a-f]?\)) \|", NOTATION, flags=re.M)
NUMBERS = ("runs", "claims-said", "table-1-numbers", "table-1-said", "text-numbers")
NUMBERS += ("text-numbers-said", "table-2-numbers", "table-2-said")
ALGORITHM_1 = 11  # its lines, where a loop and its end are one


@pytest.fixture
def said(monkeypatch) -> dict[str, str]:
    """What the cells display that need no run, by their id."""
    monkeypatch.setattr("nmpcrl.study.fetch_all", lambda _: {})
    names: dict = {"layout": "A", "experiments": ()}
    shown: dict[str, str] = {}
    for cell in NUMBERS:
        texts: list[str] = []
        monkeypatch.setattr(prose, "_show", texts.append)
        exec(CELLS[cell], names)
        shown[cell] = "\n".join(texts)
    return shown


def rows(text: str) -> list[list[str]]:
    """The cells of a table in Markdown, without its head."""
    lines = [line[1:-1].split("|") for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line] for line in lines[2:]]


def test_every_equation_has_a_line_that_says_where_it_is():
    lines = rows(CELLS["equations"])
    assert [what.split()[0] for what, *_ in lines] == EQUATIONS
    for what, where, _ in lines:
        links = re.findall(r"\(([\w.]+)#((?:eq|alg)-[\w-]+)\)", where)
        assert links, what
        for page, anchor in links:
            assert f'<a id=\\"{anchor}\\"></a>' in (ROOT / "book" / page).read_text(), what


def test_both_maps_of_the_equations_lead_to_the_same_places():
    here = {what.split()[0]: where for what, where, _ in rows(CELLS["equations"])}
    there = dict(re.findall(r"^\| (\(\d+[a-f]?\)) \| (.*?) \| ", NOTATION, flags=re.M))
    for number, what in there.items():
        for link in re.findall(r"\[Eq\. [^]]*\]\([^)]*\)", what):
            assert link in here[number], number
        assert number[-2].isalpha() or "#eq-" in what or "#alg-" in what, number


def test_every_figure_is_drawn_under_its_number_in_the_paper():
    captions = "\n".join(text for cell, text in CELLS.items() if cell.endswith("caption"))
    numbers = re.findall(r"\*\*Fig\. (\d)\.\*\* The paper's Fig\. (\d)", captions)
    assert numbers == [(number, number) for number in "1234"]
    assert re.findall(r"draw\.figure_(\d)\(", PAGE) == list("1234")


@pytest.mark.parametrize("item", ["Algorithm 1", "Table I:", "Table II:"])
def test_the_algorithm_and_both_tables_have_a_section(item):
    assert re.search(rf"^## {item}", PAGE, flags=re.M)


def test_every_line_of_the_algorithm_names_what_does_it():
    lines = rows(CELLS["algorithm"])
    assert len(lines) == ALGORITHM_1
    assert all(re.match(r"`[\w.]+`", here) for _, here, _ in lines)


def test_every_claim_is_quoted_and_has_its_published_verdict(said):
    items = said["claims-said"].removeprefix("- ").split("\n- ")
    quoted = re.compile(r"\*\*\[(C\d)\]\([^)]*\)\*\*, \*(.+?)\*[. ].*?“(.+?)”", re.S)
    found = [quoted.match(item) for item in items]
    words = {one.claim: one.words for one in published.load().verdicts}
    assert [(one[1], one[2]) for one in found] == [(claim, words[claim]) for claim in CLAIMS]
    assert all(len(one[3].split()) <= 30 for one in found)


@pytest.mark.parametrize("table", ["table-1-said", "text-numbers-said"])
def test_a_number_that_is_not_the_papers_has_a_departure(said, table):
    lines = rows(said[table])
    assert len(lines) == 9
    for what, printed, here, differs in lines:
        same = printed.replace(r"$\pi/2$", "1.571").replace(" m,", ",") == here
        assert same or "#departure-" in differs, what


def test_the_published_ratios_stand_beside_table_2(said):
    lines = {method: row for method, *row in rows(said["table-2-said"])}
    assert list(lines) == ["ES", "GES", "RDES", "DES"]
    known = {one.claim: one for one in published.load().verdicts}
    for method, claim in (("GES", "C4"), ("RDES", "C3")):
        hours, share, here = lines[method]
        assert float(share) == float(hours.split()[-1]) / float(lines["ES"][0].split()[-1])
        assert here.startswith(f"{known[claim].ratio:.2f} [")
        assert here.endswith(f"], {claim} *{known[claim].words}*")


def test_every_departure_stands_beside_an_item(said):
    linked = re.findall(r"#departure-([A-Z])\)", PAGE + "".join(said.values()))
    assert set(linked) == set(DEPARTURES)
