"""Typeset the article, a report of this reproduction as ReScience C asks for one: `make article`.

    python book/article.py                     _build/html/nmpcrl-article.pdf
    python book/article.py _build/smoke/html   _build/smoke/html/nmpcrl-article.pdf

Four steps, each a function:

1. `values`   every number, table and sentence with a number, from what is published
2. `figures`  what the article draws, by the functions that draw for the book
3. `typeset`  book/article.typ with these, by Typst
4. `offer`    a link to it where the introduction has a place for one

The template has words and formulas, and no number; it needs no network and no font of the system.
"""

import json
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import click
import pandas as pd
import typst
from pypdf import PdfReader

from driver.paper import markup
from driver.paper.pdf import version
from driver.project import ROOT, Failure, from_yaml, reported, shown
from nmpcrl.claims import evidence, prespecified, published, robustness
from nmpcrl.claims.finding import Finding, finding
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import CLAIMS
from nmpcrl.claims.published import Evidence, Published
from nmpcrl.claims.verdict import Verdict
from nmpcrl.report import drawn, halves, tables, text
from nmpcrl.report import finding as said
from nmpcrl.report import verdicts as sentences
from nmpcrl.report.figures.verdicts import claims as verdicts
from nmpcrl.report.figures.verdicts import failure_modes
from nmpcrl.report.open_questions import QUESTIONS
from nmpcrl.studies import population
from nmpcrl.study import design, paper
from nmpcrl.study.departures import DEPARTURES
from nmpcrl.study.experiment import MAIN
from nmpcrl.study.learners import DECAYS

NAME = "nmpcrl-article.pdf"
TEMPLATE, BIBLIOGRAPHY, ROBOT = (
    ROOT / "book" / path for path in ("article.typ", "references.bib", "_static/closed_loop.svg")
)
TOPICS = {  # the section that has the evidence on a claim
    "stability": ("C1", "C2", "C6", "C8"),
    "policies": ("C5", "C7", "C9"),
    "time": ("C3", "C4"),
}
PLACE = re.compile(r'(<div class="the-article">).*?(</div>)', flags=re.S)
LINK = """<p>Or on paper, in ten minutes: <a href="{}">the article</a>, the whole report on
{} pages (PDF, {:.1f} MB).</p>"""


@dataclass(frozen=True)
class Source:
    """What the article rests on."""

    found: Published
    seen: Finding | None
    claims: list[Verdict]  # on what the paper claims
    own: list[Verdict]  # and on what we do
    judged: Evidence
    changed: pd.DataFrame  # of `robustness.variant_changes`


def source() -> Source:
    """What is published, judged.

    Raises:
        Failure: nothing is, or it is damaged.
    """

    try:
        found = published.load()
    except published.Damaged as error:
        raise Failure(str(error)) from error
    whole = evidence.gather("published", variants=True)
    return Source(
        found,
        finding(found),
        [verdict for verdict in found.verdicts if verdict.claim in CLAIMS],
        [verdict for verdict in found.verdicts if verdict.claim in OWN_CLAIMS],
        whole,
        robustness.variant_changes(whole.runs, whole.paths),
    )


def values(given: Source) -> dict[str, Any]:
    """What the template shows, by name; texts are markup of Typst."""
    return _about() | _sentences(given) | _tables(given) | _sizes()


def _about() -> dict[str, Any]:
    """What the files about the project say."""
    metadata = from_yaml("metadata.yaml")
    (paper,) = from_yaml("CITATION.cff")["references"]
    words, date = version()
    return {
        "title": metadata["title"],
        "authors": [one["name"] for one in metadata["authors"]],
        "abstract": metadata["abstract"],
        "keywords": metadata["keywords"].split(", "),
        "version": words,
        "date": [date.year, date.month, date.day],
        "paper": paper["identifiers"][0]["value"],
        "url": paper["url"],
    }


def _sentences(given: Source) -> dict[str, str]:

    seen, found = given.seen, given.found
    parts = {
        "answer": text.answer(given.claims),
        "finding": said.sentences(seen),
        "fixed": text.fixed(prespecified.fixed(found.about)),
        "effort": text.compute_effort(found),
        "layouts": text.by_layout_and_decay(given.claims),
        "variants": text.verdicts_changed(given.changed),
        "drawn": drawn.in_short(population.load()),
    }
    return {name: markup.text(one) for name, one in parts.items()}


def _tables(given: Source) -> dict[str, Any]:

    scope = tables.scope(given.found.main.runs)
    depends = text.depends_on(given.claims, given.changed)
    numbers = re.split(r"\s+\[[^]]+\]\(\S+\)\s*(?:- |$)|^- ", said.numbers(given.seen))[1:-1]
    asked = markup.rows(tables.claim_table(CLAIMS.values(), ""))
    return {
        "numbers": [markup.text(one) for one in numbers],
        "verdicts": markup.rows(
            tables.plain_verdict_table(given.claims, tables.asides(given.found))
        ),
        "thresholds": asked,
        "by_layout": markup.rows(tables.layout_table(given.claims, scope)),
        "evidence": {
            topic: [_evidence(one) for one in given.claims if one.claim in names]
            for topic, names in TOPICS.items()
        },
        "own": [[one.claim, markup.text(one.statement), one.words] for one in given.own],
        "departures": [
            [
                letter,
                *map(markup.text, (DEPARTURES[letter].gap, DEPARTURES[letter].reading)),
                claims,
            ]
            for letter, claims in depends.items()
        ],
        "questions": [markup.text(one.ask) for one in QUESTIONS],
    }


def _evidence(one: Verdict) -> list[str]:
    """Claim, verdict, evidence, and where another verdict is to be expected."""
    beside = halves.own(one) or sentences.by_learner(one)
    evidence = markup.text(f"{sentences.evidence(one)} {beside}".strip())
    return [one.claim, one.words, evidence, markup.text(one.would_change)]


def _sizes() -> dict[str, str]:

    counts = {
        "parameters": paper.THETA_INIT,
        "departures": DEPARTURES,
        "learners": MAIN,
        "layouts": design.LAYOUTS,
        "readings": DECAYS,
        "seeds": design.SEEDS,
        "variants": design.VARIANTS,
        "varied_seeds": design.VARIED["seed"],
    }
    return {f"n_{name}": text.number(len(of)) for name, of in counts.items()} | {
        "episodes": str(paper.EPISODES),
        "horizon": str(paper.HORIZON),
        "varied_layouts": text.listed(design.VARIED["layout"]),
    }


def figures(given: Source) -> dict[str, tuple[bytes, str]]:
    """Each figure as an SVG, and what it found in words."""

    main, verdict = given.judged.main, {one.claim: one for one in given.claims}
    drawn: dict[str, Any] = {
        "divergence": verdicts.divergence(main, verdict["C1"]),
        "reasons": failure_modes.reasons(main),
        "gains": verdicts.gains(main, verdict["C9"]),
        "times": verdicts.times(given.found.timings, verdict["C3"], "RDES"),
    }
    return {name: (one.written("svg"), one.finding) for name, one in drawn.items()}


def typeset(shown: Mapping[str, Any], drawn: Mapping[str, tuple[bytes, str]], place: Path) -> bytes:
    """The article as PDF.

    Args:
        shown: of `values`.
        drawn: of `figures`.
        place: for all that Typst reads; it is made anew.
    """

    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    for path in (TEMPLATE, BIBLIOGRAPHY, ROBOT):
        shutil.copy2(path, place)
    for name, (svg, _) in drawn.items():
        (place / f"{name}.svg").write_bytes(svg)
    findings = {name: finding for name, (_, finding) in drawn.items()}
    (place / "values.json").write_text(json.dumps({**shown, "findings": findings}))
    made: bytes = typst.compile(
        str(place / TEMPLATE.name),
        root=str(place),
        ignore_system_fonts=True,
        pdf_standards=["ua-1"],
    )
    return made


def offer(site: Path, pages: int, size: int) -> None:
    """Link to the article where a page of a built site has a place for it."""
    for path in site.glob("book/*.html"):
        before = path.read_text("utf-8")
        link = LINK.format(f"../{NAME}", pages, size / 1e6)
        after = PLACE.sub(rf"\1{link}\2", before)
        if after != before:
            path.write_text(after, "utf-8")


def make(site: Path) -> tuple[Path, int]:
    """The four steps; the file and how many pages it has."""
    if not (site / "index.html").exists():
        raise Failure(f"There is no built book in {shown(site)}: `make book` builds it.")
    target = site / NAME
    target.unlink(missing_ok=True)
    given = source()
    pdf = typeset(values(given), figures(given), site.parent / "article")
    target.write_bytes(pdf)
    pages = len(PdfReader(BytesIO(pdf)).pages)
    offer(site, pages, len(pdf))
    return target, pages


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("site", type=click.Path(path_type=Path), default=ROOT / "_build/html")
def main(site: Path) -> None:
    """Typeset the article and put it on the built book in SITE."""
    with reported(site.parent / "logs/article.log"):
        path, pages = make(site)
    click.echo(f"{shown(path)}: {pages} pages, {path.stat().st_size / 1e6:.1f} MB")
