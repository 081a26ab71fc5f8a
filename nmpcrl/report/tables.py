"""Claims, verdicts, questions, departures and times as pages show them: tables."""

import re
from collections.abc import Iterable, Mapping
from html import escape
from math import isnan

import pandas as pd

from nmpcrl.analysis.statistics import Estimate, rate
from nmpcrl.bench.learners import ratio
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
from nmpcrl.report.cited import cited
from nmpcrl.report.text import SURE, departure_link
from nmpcrl.studies.investigation import WORDS as INVESTIGATED
from nmpcrl.studies.investigation import Answer, Question
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


def shown(frame: pd.DataFrame, caption: str = "", *, escape: bool = True) -> str:
    """A table of words in HTML: whole sentences, which pages and Jupyter would put to the right.

    Args:
        frame: its index names the rows.
        caption: stands above it.
        escape: whether cells are text; else they are HTML already.
    """
    with pd.option_context("display.max_colwidth", None, "display.max_rows", None):
        html = frame.to_html(border=0, escape=escape, classes="table words")
    html = re.sub(r"<(t[hd])>", r'<\1 style="text-align: left">', html)
    return (
        html.replace("<thead>", f"<caption>{_text(caption)}</caption><thead>") if caption else html
    )


def claim_table(claims: Iterable[Claim]) -> str:
    """One row a claim: what will be asked of each run, and how it will be decided."""
    rows = {
        c.name: {
            "claim": c.statement,
            "what is asked and measured": f"{c.question} {_sentence(c.measured)}",
            "threshold and test": f"{_sentence(c.border)} {_sentence(c.test)}",
        }
        for c in claims
    }
    return shown(pd.DataFrame.from_dict(rows, "index"))


def verdict_table(verdicts: Iterable[Verdict], scope: str, beside: Iterable[Verdict] = ()) -> str:
    """One row a claim: what the paper says, and what became of it here.

    Args:
        verdicts: of `judge`.
        scope: what they rest on, a sentence for the caption.
        beside: what other runs say of the same claims, for a column of their own.
    """
    others, rows = {v.claim: v for v in beside}, {}
    for v in verdicts:
        words = {"the paper claims": f"{_aside(v)}{_text(v.statement)}", "published": _outcome(v)}
        if others:
            words["runs of this page"] = _outcome(others[v.claim], "runs of this page")
        rows[f"<strong>{v.claim}</strong>"] = words
    return shown(pd.DataFrame.from_dict(rows, "index"), scope, escape=False)


def layout_table(verdicts: Iterable[Verdict], caption: str) -> str:
    """One row a claim: its outcome overall, in each layout, and with each decay of the noise."""
    rows = {
        f"<strong>{v.claim}</strong>": {"all": _word(v.outcome)}
        | {name: _word(outcome) for name, outcome in v.by_layout.items()}
        | {f"per {name}": _word(outcome) for name, outcome in v.by_decay.items()}
        for v in verdicts
        if v.by_layout
    }
    return shown(pd.DataFrame.from_dict(rows, "index").fillna(""), caption, escape=False)


def assumption_table(assumptions: Iterable[Assumption]) -> str:
    """One row an assumption: which theorem makes it, and what is run."""
    rows = {
        a.theorem: {name: "assumed" if name in a.by else "–" for name in THEOREMS}
        | {"holds": "yes" if a.holds else "no", "here": a.here}
        for a in assumptions
    }
    return shown(pd.DataFrame.from_dict(rows, "index"))


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


def answer_table(answers: Iterable[Answer], questions: Mapping[str, Question]) -> str:
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
    return shown(pd.DataFrame.from_dict(rows, "index"))


def _share_of(name: str, yes: int, of: int) -> str:
    """What was counted, with Wilson's interval as if it were independent."""
    return f"{yes} of {of} {name}" + (f": {rate(yes, of):.0%}" if of else "")


def dependence(verdicts: Iterable[Verdict], changed: pd.DataFrame) -> str:
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
    return shown(pd.DataFrame.from_dict(rows, "index"))


def departure(letter: str) -> str:
    """What the paper has, what is done here, why, and the variant, in Markdown."""
    entry = DEPARTURES[letter]
    parts = {"The paper": entry.gap, "Here": entry.reading, "Why": entry.why}
    if entry.variant:
        parts["To run it otherwise"] = f"Set `{entry.variant}` of an `Experiment`."
    return "\n\n".join(f"**{name}.** {text}" for name, text in parts.items())


def _text(text: str) -> str:
    """Text as HTML, with the code in it marked."""
    return re.sub(r"`([^`]*)`", r"<code>\1</code>", escape(text))


def badge(text: str, outcome: str) -> str:
    """Words in the colour of an outcome."""
    return f'<span class="{BADGES[outcome]}">{text}</span>'


def _word(outcome: Outcome) -> str:
    """An outcome in a narrow cell: colour and word."""
    return badge(WORDS[outcome], outcome)


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
