"""Verdicts, assumptions and departures as the book's pages show them: HTML and Markdown text."""

import re
from collections.abc import Iterable
from dataclasses import fields
from html import escape
from math import isnan

import pandas as pd

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.claims.assumptions import THEOREMS
from nmpcrl.claims.paper_claims import CLAIMS, WIDER_THAN
from nmpcrl.claims.rule import Claim, anew
from nmpcrl.claims.verdict import (
    NOT,
    PARTLY,
    REPRODUCED,
    UNDECIDABLE,
    Assumption,
    Outcome,
    Verdict,
)
from nmpcrl.report.cited import Cited, cited
from nmpcrl.report.text import SURE, departure_link, listed
from nmpcrl.report.timing import to_es
from nmpcrl.study.departures import DEPARTURES
from nmpcrl.study.experiment import Experiment

BADGES: dict[str, str] = {  # by what is said of a claim, or by its outcome
    REPRODUCED: "verdict-reproduced",
    PARTLY: "verdict-partly",
    NOT: "verdict-not-reproduced",
    UNDECIDABLE: "verdict-undecidable",
    CLAIMS["C8"].words[NOT]: "verdict-not-applicable",  # refutes nothing: no colour of a no
}
PUBLISHED = "published"  # whose numbers a table shows, if nothing else is said
WORDS = {REPRODUCED: "yes", PARTLY: "partly", NOT: "no", UNDECIDABLE: "open"}  # in narrow cells
HELD = {True: ("holds", BADGES[REPRODUCED]), False: ("does not hold", BADGES[NOT])}


def claim_table(claims: Iterable[Claim], caption: str) -> str:
    """One row a claim, in HTML: what will be asked of each run, and how it will be decided."""
    rows = (
        (
            f"<strong>{_text(c.name)}</strong> {_text(c.statement)}",
            f"{_text(c.question)}<br>{_text(_sentence(c.measured))}",
            f"{_text(_sentence(c.border))}<br>{_text(_sentence(c.test))}",
        )
        for c in claims
    )
    return html_table(caption, ("Claim", "What is asked and measured", "Threshold and test"), rows)


def verdict_table(verdicts: Iterable[Verdict], scope: str, beside: Iterable[Verdict] = ()) -> str:
    """One row a claim, in HTML: what the paper says, and what became of it here.

    Args:
        verdicts: of `judge`.
        scope: what they rest on, a sentence for the caption.
        beside: what other runs say of the same claims, for a column of their own.
    """
    others = {v.claim: v for v in beside}
    rows = (
        (
            f"<strong>{_text(v.claim)}</strong> {_aside(v)}{_text(v.statement)}",
            _outcome(v),
            *([_outcome(others[v.claim], "runs of this page")] if others else []),
        )
        for v in verdicts
    )
    header = ("The paper claims", "Published", "Runs of this page")
    return html_table(scope, header if others else ("The paper claims", "Here"), rows)


def layout_table(verdicts: Iterable[Verdict], caption: str) -> str:
    """One row a claim, in HTML: its outcome overall, in each layout, and in each reading."""
    decided = [v for v in verdicts if v.by_layout]
    layouts = dict.fromkeys(name for v in decided for name in v.by_layout)
    decays = dict.fromkeys(name for v in decided for name in v.by_decay)
    header = ("Claim", "All", *layouts, *(f"per {name}" for name in decays))
    rows = (
        (
            f"<strong>{_text(v.claim)}</strong>",
            _word(v.outcome),
            *(_word(v.by_layout.get(name)) for name in layouts),
            *(_word(v.by_decay.get(name)) for name in decays),
        )
        for v in decided
    )
    return html_table(caption, header, rows, headed=True)


def assumption_table(assumptions: Iterable[Assumption], caption: str) -> str:
    """One row an assumption, in HTML: which theorem makes it, and what is run."""
    rows = (
        (
            _text(a.theorem),
            *("assumed" if name in a.by else "–" for name in THEOREMS),
            f"{_badge(*HELD[a.holds])}<br>{_text(a.here)}",
        )
        for a in assumptions
    )
    return html_table(caption, ("Assumption", *THEOREMS, "Here"), rows)


TIMES = {  # columns of `time_learners` with one number each, and what one of their units is
    "solves": ("solves", 1),
    "ms_per_step": ("ms per step", 1),
    "ms_per_solve": ("ms per solve", 1),
    "ms_per_fit": ("ms per fit", 1),
    "ms_per_rest": ("ms per rest", 1),
    "hours": ("run [s]", 3600),
    "hours_paper": ("paper [h]", 1),
}


def timing_table(timings: pd.DataFrame, machine: str) -> str:
    """One row a solver and learner, in HTML: Table II, with each ratio to ES and its interval.

    Args:
        timings: of `time_learners`.
        machine: that they were timed on.
    """
    rows = (
        (
            _text(f"{row['learner']} with {row['solver']}"),
            *(
                "–" if pd.isna(row[name]) else f"{one * row[name]:.3g}"
                for name, (_, one) in TIMES.items()
            ),
            _in_two_lines(to_es(timings, row["solver"], row["learner"])),
        )
        for row in timings.to_dict("records")
    )
    header = ("step of", *(words for words, _ in TIMES.values()), "ratio")
    return html_table(f"Times of a learning step on {machine}.", header, rows, headed=True)


def dependence(verdicts: Iterable[Verdict], changed: pd.DataFrame) -> str:
    """One row a claim, in Markdown: its verdict, and what changes it, by departure.

    Args:
        verdicts: of `rule.judge`.
        changed: rows of `robustness_map`; those that chance hardly explains, by `SURE`, are bold.
    """
    rows = ["| Claim | Over all | Changed by |", "|---|---|---|"]
    for v in verdicts:
        mine = changed[changed.claim == v.claim]
        by = [
            f"{_letter(str(letter))}: {listed(map(_weighed, group.variant, group.p))}"
            for letter, group in mine.groupby("departure", sort=False)
        ]
        outcome = f"{_word(v.outcome)}{_share(v)}"
        rows.append(f"| **{v.claim}** {v.statement} | {outcome} | {'<br>'.join(by) or 'nothing'} |")
    return "\n".join(rows)


def departure(letter: str) -> str:
    """What the paper has, what is done here, why, and the variant, in Markdown."""
    entry = DEPARTURES[letter]
    parts = {"The paper": entry.gap, "Here": entry.reading, "Why": entry.why}
    if entry.variant:
        parts["To run it otherwise"] = _options(entry.variant.split(", "))
    return "\n\n".join(f"**{name}.** {text}" for name, text in parts.items())


def _options(names: list[str]) -> str:
    """The fields of `Experiment`, or the one value, that choose a variant, with the defaults."""
    defaults = {field.name: field.default for field in fields(Experiment)}
    options = dict(name.partition(" = ")[::2] for name in names)
    shown = {name: f"{name} = {value}" if value else name for name, value in options.items()}
    given = ", ".join(f"`{shown[name]}` (here `{defaults[name]!r}`)" for name in options)
    first, value = next(iter(options.items()))
    return f"Set {given}, as in `sweep({first}={value or '...'})`."


LEFT = 'style="text-align: left"'  # the theme and Jupyter turn cells to the right


def html_table(
    caption: str, header: tuple[str, ...], rows: Iterable[tuple[str, ...]], *, headed: bool = False
) -> str:
    """A table whose cells are HTML already; `headed` if they are words in rows that have a name."""
    head = "".join(f'<th scope="col" {LEFT}>{_text(name)}</th>' for name in header)
    body = "".join(f"<tr>{_row(row, headed)}</tr>" for row in rows)
    return (
        f'<table class="table dataframe{" words" * headed}"><caption>{_text(caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def _row(cells: tuple[str, ...], headed: bool) -> str:
    first, *others = (f"{LEFT}>{cell}" for cell in cells)
    name = f'<th scope="row" {first}</th>' if headed else f"<td {first}</td>"
    return name + "".join(f"<td {cell}</td>" for cell in others)


def _text(text: str) -> str:
    """Text as HTML, with the code in it marked."""
    return re.sub(r"`([^`]*)`", r"<code>\1</code>", escape(text))


def _badge(text: str, style: str) -> str:
    return f'<span class="{style}">{text}</span>'


def _word(outcome: Outcome | None) -> str:
    """An outcome in a narrow cell: colour and word; nothing where nothing was judged."""
    return _badge(WORDS[outcome], BADGES[outcome]) if outcome else ""


def _share(verdict: Verdict, source: str = PUBLISHED) -> str:
    """The share, or ratio, on which a verdict rests, below its badge.

    Its interval is for other seeds, or other steps; below it, the one for other layouts.
    """
    if verdict.interval is None:
        return ""
    value, form = (verdict.ratio, ".2f") if verdict.share is None else (verdict.share, ".0%")
    assert value is not None
    number, kind = Estimate(value, *verdict.interval), "ratio" if form == ".2f" else "share"
    lines = [cited(format(number, form), number, f"{verdict.claim}, {kind}: {source}")]
    if not isnan((other := anew(verdict)).low):
        what = f"{verdict.claim}, share in other layouts: {source}"
        lines += ["other layouts", cited(f"[{other.low:.0%}, {other.high:.0%}]", other, what)]
    return "".join(f"<br>{line}" for line in lines)


def _in_two_lines(ratio: Cited) -> str:
    """A ratio above its interval, for a narrow column."""
    _, _, interval = str(ratio.value).partition(" ")
    return f'{ratio:.2f}<br><span style="white-space: nowrap">{interval}</span>'


def _outcome(verdict: Verdict, source: str = PUBLISHED) -> str:
    """What became of a claim, and the number on which that rests."""
    return f"{_labelled(verdict)}{_share(verdict, source)}"


def _labelled(verdict: Verdict) -> str:
    """What is said of a claim, in the colour of those words or else of its outcome."""
    return _badge(verdict.words, BADGES.get(verdict.words, BADGES[verdict.outcome]))


def _aside(verdict: Verdict) -> str:
    """Before the statement of what the paper does not say."""
    if verdict.claim in WIDER_THAN:
        return f"<em>Wider than {WIDER_THAN[verdict.claim]}:</em> "
    implied = verdict.claim in CLAIMS and CLAIMS[verdict.claim].implied
    return "<em>Implied:</em> " if implied else ""


def _letter(letter: str) -> str:
    """A link to an assumption of ours; the paper is clear about what has none."""
    return departure_link(letter, letter) if letter else "no assumption of ours"


def _weighed(variant: str, p: float) -> str:
    return f"**{variant}**" if p < SURE else variant


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def linked(text: str) -> str:
    """Markdown in which "our assumption C" is a link to its entry."""
    return re.sub(r"\b(our assumption ([A-Z]))\b", lambda it: departure_link(it[1], it[2]), text)
