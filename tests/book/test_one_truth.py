"""One truth: no two pages say different things of one quantity, and none of what is published."""

import re
from collections.abc import Iterator

import pytest
from bs4 import BeautifulSoup, Tag
from driver import project

from nmpcrl.bench.learners import ratio
from nmpcrl.claims import published
from nmpcrl.claims.verdict import Verdict
from nmpcrl.report.tables import BADGES
from nmpcrl.report.timing import of_steps

PAGES = project.pages()
each_page = pytest.mark.parametrize("page", PAGES)

CLAIM = r"[BCW]\d"
LISTED = rf"\(({CLAIM}(?:(?:, | and ){CLAIM})*)\)"
OUTCOME = "((?:partly |not )?reproduced|not decidable here)"
COUNTED = re.compile(rf"(?:\w+ (?:is|are)|for \w+) {OUTCOME} {LISTED}")
TITLED = re.compile(rf"\b({CLAIM}) {OUTCOME}:")
TIME = re.compile(
    r"(RDES|GES) t(?:akes|ook) (\d\.\d\d)(?: \[[\d., ]+\])? of (?:the time of )?(?:a step of )?ES"
    r" (?:with (Ipopt|fatrop|riccati)|\(C[34])"
)
SOLVER = {"Ipopt": "ipopt", None: "ipopt"}


def contradictions(page: BeautifulSoup, known: dict[str, Verdict]) -> list[str]:
    """Where a page names a claim with an outcome, a share or a ratio that is another."""
    article = page.find("article")
    wrong = []
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


def statements(page: BeautifulSoup) -> list[tuple[str, str]]:
    """The numbers on a page that carry what they are of, each with all its digits."""
    return [(one["title"], one["value"]) for one in page.select("data[title]")]


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
    said: dict[str, dict[str, str]] = {}
    for page in PAGES:
        for quantity, value in statements(html(f"{page}.html")):
            said.setdefault(quantity, {}).setdefault(value, page)
    assert len({page for values in said.values() for page in values.values()}) >= 5
    assert {name: values for name, values in said.items() if len(values) > 1} == {}


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
    assert quantity in dict(statements(html(f"book/{page}.html")))


def test_every_verdict_is_shown_and_every_ratio_of_times_is_the_published_one(html, known):
    badges = ", ".join(f".{style}" for style in BADGES.values())
    shown = html("book/05_results.html").select(f"td :is({badges})")
    names = [badge.find_parent("tr").find("strong") for badge in shown]
    assert {name.get_text() for name in names if name} >= {c for c in known if c.startswith("C")}
    found = published.load()
    for page in PAGES:
        text = " ".join(html(f"{page}.html").find("article").get_text(" ").split())
        for learner, shown, solver in TIME.findall(text):
            expected = ratio(found.timings, SOLVER.get(solver or None, solver), learner).value
            assert shown == f"{expected:.2f}", f"{page}: {learner} {shown} with {solver}"
    assert TIME.search(" ".join(html("book/evidence.html").find("article").get_text(" ").split()))
