"""One truth: no two pages say different things of one quantity, and none of what is published."""

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import pytest
from bs4 import BeautifulSoup, Tag
from driver import project

from nmpcrl.bench.learners import ratio
from nmpcrl.claims import published
from nmpcrl.claims.verdict import Verdict
from nmpcrl.report.prose import filled
from nmpcrl.report.tables import BADGES, WORDS
from nmpcrl.report.timing import of_steps

PAGES = project.pages()
each_page = pytest.mark.parametrize("page", PAGES)

CLAIM = r"[BCW]\d"
LISTED = rf"\(({CLAIM}(?:(?:, | and ){CLAIM})*)\)"
COUNTED = re.compile(rf"(?:\w+ (?:is|are)|for \w+) ([a-z][a-z ]*[a-z]) {LISTED}")
SHARE = re.compile(r"(\d+)% \[(\d+)%, (\d+)%\]|(\d\.\d\d) \[(\d\.\d\d), (\d\.\d\d)\]")
TITLED = re.compile(rf"\b({CLAIM}) ((?:partly |not )?reproduced|not decidable here):")
TIME = re.compile(
    r"(RDES|GES) t(?:akes|ook) (\d\.\d\d)(?: \[[\d., ]+\])? of (?:the time of )?(?:a step of )?ES"
    r" (?:with (Ipopt|fatrop|riccati)|\(C[34])"
)
SOLVER = {"Ipopt": "ipopt", None: "ipopt"}


def contradictions(page: BeautifulSoup, known: dict[str, Verdict]) -> list[str]:
    """Where a page names a claim with an outcome, a share or a ratio that is another."""
    article = page.find("article")
    wrong = [one for badge in article.select(BADGE) for one in badly_labelled(badge, known)]
    wrong += [one for table in article.find_all("table") for one in badly_mapped(table, known)]
    for text in paragraphs(article):
        for words, names in COUNTED.findall(text):
            wrong += [f"{c} {words}" for c in re.findall(CLAIM, names) if known[c].words != words]
        for name, words in TITLED.findall(text):
            wrong += [f"{name} {words}"] if name in known and known[name].words != words else []
    return wrong


def paragraphs(article: Tag) -> Iterator[str]:
    """What stands in a page, and what is read out of its pictures, each without line breaks."""
    for block in article.find_all(["p", "li", "td"]):
        if not block.find(["p", "li", "td"]):  # else its parts are looked at
            yield " ".join(block.get_text(" ").split())
    for picture in article.find_all("img"):
        yield " ".join(picture["alt"].split())


def badly_mapped(table: Tag, known: dict[str, Verdict]) -> list[str]:
    """Rows of a table of variants whose outcome is not that of the verdict in this part."""
    names = [one.get_text().strip() for one in table.select("thead :is(th, td)")]
    if not {"variant", "claim", "outcome"} <= set(names):
        return []
    wrong = []
    for row in table.select("tbody tr"):
        cells = [one.get_text().strip() for one in row.find_all(["th", "td"])]
        named = dict(zip(names, cells, strict=True))
        verdict, part = known[named["claim"]], named["variant"].split()[-1]
        outcome = (verdict.by_layout | verdict.by_decay).get(part)
        if named["variant"].startswith(("layout", "decay")) and outcome != named["outcome"]:
            wrong.append(f"{verdict.claim} {named['variant']}: {named['outcome']}")
    return wrong


BADGE = ", ".join(f".{style}" for style in BADGES.values())


def badly_labelled(badge: Tag, known: dict[str, Verdict]) -> list[str]:
    """What is wrong with a coloured outcome and the number below it, in a table or a list."""
    row = badge.find_parent(["tr", "li"])
    name = row and row.find("strong") and re.match(CLAIM, row.find("strong").get_text())
    if not name:
        return []  # of an assumption, or of a target
    verdict, cell = known[name[0]], badge.find_parent(["td", "li"])
    expected, column = verdict.outcome, heading(cell)
    if column == "First edition":
        return []  # of runs that were made anew since
    if column in verdict.by_layout | verdict.by_decay:
        expected = (verdict.by_layout | verdict.by_decay)[column]
    elif verdict.words == badge.get_text():
        expected = None
    wrong = [] if expected is None or badge.get_text() == WORDS[expected] else [badge.get_text()]
    if cell.name == "td" and (found := SHARE.search(" ".join(cell.get_text(" ").split()))):
        value = verdict.ratio if verdict.share is None else verdict.share
        form = ".2f" if verdict.share is None else ".0%"
        low, high = (format(one, form) for one in verdict.interval)
        wrong += [] if found[0] == f"{value:{form}} [{low}, {high}]" else [found[0]]
    return [f"{name[0]} {one}" for one in wrong]


def heading(cell: Tag) -> str:
    """What stands above a cell, without "per": the layout, or the reading of the decay."""
    heads = cell.find_parent("table").select("thead :is(th, td)") if cell.name == "td" else []
    index = len(cell.find_previous_siblings(["th", "td"])) if heads else 0
    return heads[index].get_text().strip().removeprefix("per ") if heads else ""


class Statement(NamedTuple):
    """A number on a page."""

    quantity: str  # what it is of, whose, and from where
    value: str  # to all digits
    page: str


def disagreements(statements: Iterable[Statement]) -> list[str]:
    """The quantities of which pages have different numbers, each with the pages."""
    said: dict[str, dict[str, str]] = {}
    for one in statements:
        said.setdefault(one.quantity, {}).setdefault(one.value, one.page)
    return [f"{name}: {values}" for name, values in said.items() if len(values) > 1]


def statements(page: BeautifulSoup, name: str) -> list[Statement]:
    """The numbers on a page that carry what they are of."""
    return [Statement(one["title"], one["value"], name) for one in page.select("data[title]")]


@pytest.fixture(scope="session")
def known() -> dict[str, Verdict]:
    """The published verdicts, by claim."""
    return {verdict.claim: verdict for verdict in published.load().verdicts}


@each_page
def test_a_page_names_no_claim_with_another_outcome_or_share_than_the_published_one(
    html, known, page
):
    assert contradictions(html(f"{page}.html"), known) == []


def test_no_two_numbers_of_one_quantity_differ(html):
    said = [one for page in PAGES for one in statements(html(f"{page}.html"), page)]
    assert len({one.page for one in said}) >= 5
    assert disagreements(said) == []


@pytest.mark.parametrize(
    ("page", "quantity"),
    [
        ("03_rdes", "early: the published main table"),
        ("03_rdes", of_steps("RDES", "ipopt")),
        ("06_why_learning_stops", "alone: rollouts of this page"),
        ("07_what_to_try_first", "at margin: the published searches"),
        ("07_what_to_try_first", "by hand: rollouts of this page"),
        ("intro", "layouts solved by hand: rollouts of this build"),
    ],
)
def test_a_number_beside_those_of_a_pages_runs_says_its_own_source(html, page, quantity):
    assert quantity in {one.quantity for one in statements(html(f"book/{page}.html"), page)}


def test_the_page_that_lists_the_papers_claims_shows_every_verdict(html, known):
    shown = html("book/05_results.html").select(f"td :is({BADGE})")
    names = [badge.find_parent("tr").find("strong") for badge in shown]
    assert {name.get_text() for name in names if name} >= {c for c in known if c.startswith("C")}


def test_every_ratio_of_times_is_the_published_one(html):
    found = published.load()
    for page in PAGES:
        text = " ".join(html(f"{page}.html").find("article").get_text(" ").split())
        for learner, shown, solver in TIME.findall(text):
            expected = ratio(found.timings, SOLVER.get(solver or None, solver), learner).value
            assert shown == f"{expected:.2f}", f"{page}: {learner} {shown} with {solver}"
    assert TIME.search(" ".join(html("book/evidence.html").find("article").get_text(" ").split()))


@pytest.mark.parametrize(
    "wrong",
    [
        '<tr><td><strong>C2</strong> So.</td><td><span class="verdict-partly">partly reproduced'
        "</span></td></tr>",
        '<tr><td><strong>C1</strong> So.</td><td><span class="verdict-partly">partly reproduced'
        "</span><br>23% [15%, 30%]</td></tr>",
        "<tr><td>One is partly reproduced (C2).</td></tr>",
        '<tr><td><img alt="C1 not reproduced: it is so."></td></tr>',
        "<thead><tr><th>variant</th><th>claim</th><th>outcome</th></tr></thead><tbody><tr>"
        "<td>decay per episode</td><td>C1</td><td>not reproduced</td></tr></tbody>",
    ],
    ids=[
        "outcome",
        "share",
        "sentence",
        "outcome in a picture",
        "map",
    ],
)
def test_a_contradiction_is_found(known, wrong):
    page = BeautifulSoup(f"<article><table>{wrong}</table></article>", "html.parser")
    assert len(contradictions(page, known)) == 1


def test_a_layouts_outcome_is_held_against_that_layouts(known):
    cells = {"A": "partly", "B": "no"}
    for shown, count in ((cells, 0), (cells | {"B": "yes"}, 1)):
        head = "".join(f"<th>{name}</th>" for name in ("Claim", *shown))
        row = "".join(
            f'<td><span class="verdict-partly">{one}</span></td>' for one in shown.values()
        )
        table = f"<thead><tr>{head}</tr></thead><tr><th><strong>C1</strong></th>{row}</tr>"
        page = BeautifulSoup(f"<article><table>{table}</table></article>", "html.parser")
        assert len(contradictions(page, known)) == count


ORIGIN = "720 runs published"


@pytest.mark.parametrize(
    ("name", "one", "other"),
    [
        ("wrong", 252, 253),
        ("gap", 190, 189),
        ("states_in_obstacles", 1000, 1035),
        ("rdes_to_es_with_ipopt", 0.63, 0.67),
        ("rdes_to_es_with_riccati", 2.39, 2.30),
        ("seconds_of_es", 2.6, 3.7),
        ("seconds_of_rdes", 6.2, 9.7),
        ("break_even", 0.10, 0.13),
        ("later", 0.1, 0.2),
    ],
)
def test_two_numbers_of_one_quantity_are_found_on_two_pages(name, one, other):
    def said(number: float, origin: str = ORIGIN) -> list[Statement]:
        page = filled(f"So {{{name}}}.", origin=origin, **{name: number})
        return statements(BeautifulSoup(page, "html.parser"), f"page of {number}")

    assert disagreements([*said(one), *said(one)]) == []
    assert disagreements([*said(one), *said(other, "another processor")]) == []
    (found,) = disagreements([*said(one), *said(other)])
    assert f"page of {one}" in found
    assert f"page of {other}" in found
