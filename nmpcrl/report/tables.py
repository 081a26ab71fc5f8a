"""Claims, verdicts, questions, departures and times as pages show them: tables."""

import re
from collections.abc import Iterable, Mapping
from html import escape
from math import isnan

import pandas as pd

from nmpcrl.analysis.statistics import Estimate, rate
from nmpcrl.bench.learners import ratio
from nmpcrl.claims.assumptions import THEOREMS
from nmpcrl.claims.investigation import WORDS as INVESTIGATED
from nmpcrl.claims.investigation import Answer, Question
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
from nmpcrl.report.cited import cited
from nmpcrl.report.text import SURE, departure_link
from nmpcrl.study.departures import DEPARTURES

BADGES: dict[str, str] = {  # by what is said of a claim, or by its outcome
    REPRODUCED: "verdict-reproduced",
    PARTLY: "verdict-partly",
    NOT: "verdict-not-reproduced",
    UNDECIDABLE: "verdict-undecidable",
    CLAIMS["C8"].words[NOT]: "verdict-not-applicable",  # refutes nothing: no colour of a no
}
PUBLISHED = "published"  # whose numbers a table shows, if nothing else is said
WORDS = {REPRODUCED: "yes", PARTLY: "partly", NOT: "no", UNDECIDABLE: "open"}  # in narrow cells


def claim_table(claims: Iterable[Claim]) -> pd.DataFrame:
    """One row a claim: what will be asked of each run, and how it will be decided."""
    rows = {
        c.name: {
            "claim": c.statement,
            "what is asked and measured": f"{c.question} {_sentence(c.measured)}",
            "threshold and test": f"{_sentence(c.border)} {_sentence(c.test)}",
        }
        for c in claims
    }
    return pd.DataFrame.from_dict(rows, "index")


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


def assumption_table(assumptions: Iterable[Assumption]) -> pd.DataFrame:
    """One row an assumption: which theorem makes it, and what is run."""
    rows = {
        a.theorem: {name: "assumed" if name in a.by else "–" for name in THEOREMS}
        | {"holds": "yes" if a.holds else "no", "here": a.here}
        for a in assumptions
    }
    return pd.DataFrame.from_dict(rows, "index")


TIMES = {  # columns of `time_learners` with one number each, and what one of their units is
    "solves": ("solves", 1),
    "ms_per_step": ("ms per step", 1),
    "ms_per_solve": ("ms per solve", 1),
    "ms_per_fit": ("ms per fit", 1),
    "ms_per_rest": ("ms per rest", 1),
    "hours": ("run [s]", 3600),
    "hours_paper": ("paper [h]", 1),
}


def timing_table(timings: pd.DataFrame) -> pd.DataFrame:
    """One row a solver and learner: Table II, with each ratio to ES and its interval.

    Args:
        timings: of `time_learners`.
    """
    shown = timings.set_index(["solver", "learner"])
    columns = {name: (one * shown[of]).map("{:.3g}".format) for of, (name, one) in TIMES.items()}
    columns["ratio"] = [str(ratio(timings, *name)) for name in shown.index]
    return pd.DataFrame(columns).replace("nan", "–")


def answer_table(answers: Iterable[Answer], questions: Mapping[str, Question]) -> pd.DataFrame:
    """One row a question: what was asked and expected, what was found, and on what that rests.

    Args:
        answers: in the order in which they are shown.
        questions: of an investigation, by name.
    """
    rows = {}
    for one in answers:
        asked = questions[one.question]
        counts = [_share_of(name, *count) for name, count in one.counts.items()]
        counts += [f"{yes} of {of} {name}" for name, (yes, of) in one.beside.items()]
        counts += [f"{name} {number:.3g}" for name, number in one.numbers.items()]
        rows[asked.name] = {
            "question": f"{asked.pilot} {asked.question}".strip(),
            "expected": INVESTIGATED.get(asked.expected, asked.expected),
            "found": one.words,
            "evidence": "; ".join(counts),
        }
    return pd.DataFrame.from_dict(rows, "index")


def _share_of(name: str, yes: int, of: int) -> str:
    """What was counted, with Wilson's interval as if it were independent."""
    return f"{yes} of {of} {name}" + (f": {rate(yes, of):.0%}" if of else "")


def dependence(verdicts: Iterable[Verdict], changed: pd.DataFrame) -> pd.DataFrame:
    """One row a claim: its verdict, and what changes it, by the letter of our assumption.

    Args:
        verdicts: of `rule.judge`.
        changed: rows of `robustness_map`; a star marks those that are more than chance, by `SURE`.
    """
    names = changed.variant.where(~(changed.p < SURE), changed.variant + "*")
    rows = {}
    for v in verdicts:
        mine = names[changed.claim == v.claim].groupby(changed.departure, sort=False).agg(", ".join)
        by = [f"{letter or 'no assumption'}: {each}" for letter, each in mine.items()]
        rows[v.claim] = {"claim": v.statement, "verdict": v.words, "changed by": "; ".join(by)}
    return pd.DataFrame.from_dict(rows, "index")


def departure(letter: str) -> str:
    """What the paper has, what is done here, why, and the variant, in Markdown."""
    entry = DEPARTURES[letter]
    parts = {"The paper": entry.gap, "Here": entry.reading, "Why": entry.why}
    if entry.variant:
        parts["To run it otherwise"] = f"Set `{entry.variant}` of an `Experiment`."
    return "\n\n".join(f"**{name}.** {text}" for name, text in parts.items())


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


def badge(text: str, outcome: str) -> str:
    """Words in the colour of an outcome."""
    return f'<span class="{BADGES[outcome]}">{text}</span>'


def _word(outcome: Outcome | None) -> str:
    """An outcome in a narrow cell: colour and word; nothing where nothing was judged."""
    return badge(WORDS[outcome], outcome) if outcome else ""


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


def _outcome(verdict: Verdict, source: str = PUBLISHED) -> str:
    """What became of a claim, and the number on which that rests."""
    return f"{_labelled(verdict)}{_share(verdict, source)}"


def _labelled(verdict: Verdict) -> str:
    """What is said of a claim, in the colour of those words or else of its outcome."""
    return badge(verdict.words, verdict.words if verdict.words in BADGES else verdict.outcome)


def _aside(verdict: Verdict) -> str:
    """Before the statement of what the paper does not say."""
    if verdict.claim in WIDER_THAN:
        return f"<em>Wider than {WIDER_THAN[verdict.claim]}:</em> "
    implied = verdict.claim in CLAIMS and CLAIMS[verdict.claim].implied
    return "<em>Implied:</em> " if implied else ""


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def linked(text: str) -> str:
    """Markdown in which "our assumption C" is a link to its entry."""
    return re.sub(r"\b(our assumption ([A-Z]))\b", lambda it: departure_link(it[1], it[2]), text)
