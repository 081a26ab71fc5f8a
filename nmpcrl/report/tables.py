"""Claims, verdicts, questions, departures and times as pages show them: tables."""

import re
from collections.abc import Iterable, Mapping
from html import escape
from math import isnan

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import Estimate, rate
from nmpcrl.claims.paper_claims import BY_RUNS, CLAIMS, WIDER_CLAIMS, WIDER_THAN
from nmpcrl.claims.rule import Claim, Paths, anew
from nmpcrl.claims.verdict import (
    NOT,
    PARTLY,
    REPRODUCED,
    UNDECIDABLE,
    Outcome,
    Verdict,
)
from nmpcrl.report.cited import cited
from nmpcrl.report.text import departure_link
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
SHORT = {  # claims in the heads of columns, in HTML
    name: one.short.replace(r"$\theta_\mathrm{init}$", "θ<sub>init</sub>")
    for name, one in (BY_RUNS | WIDER_CLAIMS).items()
}
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
    html = re.sub(r"<(t[hd])\b([^>]*)>", r'<\1\2 style="text-align: left">', html)
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


def answer_table(answers: Iterable[Answer], questions: Mapping[str, Question]) -> str:
    """One row a question: what was asked and expected, what was found, and on what that rests.

    Args:
        answers: in the order in which they are shown.
        questions: of an investigation, by name.
    """
    rows = {}
    for one in answers:
        asked = questions[one.question]
        counts = [  # with Wilson's interval, as if they were independent
            f"{yes} of {of} {name}" + (f": {rate(yes, of):.0%}" if of else "")
            for name, (yes, of) in one.counts.items()
        ]
        counts += [f"{yes} of {of} {name}" for name, (yes, of) in one.beside.items()]
        counts += [f"{name} {number:.3g}" for name, number in one.numbers.items()]
        rows[asked.name] = {
            "question": f"{asked.pilot} {asked.question}".strip(),
            "expected": INVESTIGATED.get(asked.expected, asked.expected),
            "found": one.words,
            "evidence": "; ".join(counts),
        }
    return shown(pd.DataFrame.from_dict(rows, "index"))


def verdict_map(judged: pd.DataFrame) -> str:
    """The rows of `robustness_map`, a column a claim: its outcome and the share of yes.

    An arrow comes from the outcome that a row changes.
    """
    before = judged.base.map(WORDS).add(" → ").where(judged.changes.astype(bool), "")
    shares = judged.share.map(" {:.0%}".format, na_action="ignore").fillna("")
    cells = before + judged.outcome.map(_word) + shares
    letters = judged.departure.replace("", "–")
    rows = judged.assign(cell=cells, departure=letters).set_index(["departure", "variant", "claim"])
    by_claim = rows.cell.unstack(sort=False).fillna("").rename_axis(["letter", "changed"])
    by_claim.columns = [f"{name}<br>{SHORT[name]}" for name in by_claim]
    return shown(by_claim, escape=False)


def other_thresholds(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """Each claim's share of yes at other thresholds, and between which its outcome is the same."""
    rows = {}
    for name, claim in BY_RUNS.items():
        values, own = claim.measure(runs, paths), claim.threshold
        around = {f"{times:g} times": claim.nothing + times * (own - claim.nothing)
                  for times in (0.5, 1.0, 2.0)}  # fmt: skip
        shares = claim.at_borders(values, around.values()).share.map("{:.0%}".format)
        low, high = same_outcome(claim.at_borders(values, np.sort([*claim.borders, own])), own)
        rows[name] = {"number": claim.label, "threshold": f"{own:.3g}"}
        rows[name] |= dict(zip(around, shares, strict=True))
        rows[name] |= {"the same from": f"{low:.2g}", "to": f"{high:.2g}"}
    return pd.DataFrame.from_dict(rows, "index")


def same_outcome(curve: pd.DataFrame, border: float) -> tuple[float, float]:
    """Between which borders, around one of them, the outcome stays what it is there.

    Args:
        curve: of `RunClaim.at_borders`, in ascending order.
        border: one of them.
    """
    stretch = curve.outcome.ne(curve.outcome.shift()).cumsum()
    same = curve.border[stretch == stretch[curve.border.sub(border).abs().idxmin()]]
    return same.min(), same.max()


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
    """What became of a claim, in the colour of those words or its outcome, and its number."""
    key = verdict.words if verdict.words in BADGES else verdict.outcome
    return f"{badge(verdict.words, key)}{_share(verdict, source)}"


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
