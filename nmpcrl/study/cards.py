"""Verdicts, assumptions and departures as the book's pages show them: HTML and Markdown text."""

import re
from collections.abc import Iterable
from dataclasses import fields
from html import escape

from nmpcrl.study.audit import Assumption
from nmpcrl.study.bench.targets import Target
from nmpcrl.study.claims import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Verdict
from nmpcrl.study.departures import DEPARTURES
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.store import Study

BADGES = {
    REPRODUCED: "verdict-reproduced",
    PARTLY: "verdict-partly",
    NOT: "verdict-not-reproduced",
    UNDECIDABLE: "verdict-undecidable",
}
MET = {
    True: ("reached", BADGES[REPRODUCED]),
    False: ("missed", BADGES[NOT]),
    None: ("not measured", BADGES[UNDECIDABLE]),
}
HELD = {True: ("holds", BADGES[REPRODUCED]), False: ("does not hold", BADGES[NOT])}


def verdict_table(verdicts: Iterable[Verdict], scope: str) -> str:
    """One row a claim, in HTML: what the paper says, and what became of it here.

    Args:
        verdicts: of `judge`.
        scope: what they rest on, a sentence for the caption.
    """
    rows = (
        (f"<strong>{v.claim}</strong> {escape(v.statement)}", _badge(v.outcome, BADGES[v.outcome]))
        for v in verdicts
    )
    return _table(scope, ("The paper claims", "Here"), rows)


def assumption_table(assumptions: Iterable[Assumption], caption: str) -> str:
    """One row an assumption of the theorem, in HTML: what it asks for and what is run."""
    rows = (
        (escape(a.theorem), f"{_badge(*HELD[a.holds])}<br>{escape(a.here)}") for a in assumptions
    )
    return _table(caption, ("The theorem assumes", "Here"), rows)


def target_table(targets: Iterable[Target], caption: str) -> str:
    """One row a figure to reach, in HTML: what was measured, and whether that is enough."""
    rows = (
        (escape(t.what), escape(t.to_reach), f"{_badge(*MET[t.reached])}<br>{escape(t.measured)}")
        for t in targets
    )
    return _table(caption, ("What", "To reach", "Here"), rows)


def evidence(verdicts: Iterable[Verdict]) -> str:
    """One definition a claim, in Markdown: verdict, evidence, and where it would change."""
    return "\n\n".join(
        f"{v.claim}: {v.statement}\n"
        f": [{v.outcome}]{{.{BADGES[v.outcome]}}} {v.evidence}\n\n"
        f"  *Where it would change.* {_linked(v.would_change)}"
        for v in verdicts
    )


def scope(study: Study) -> str:
    """What a study covers, in a sentence."""
    layouts, seeds, readings, episodes = (
        study.values_of(name) for name in ("layout", "seed", "decay", "episodes")
    )
    return (
        f"Judged from {len(study)} runs of {_all(episodes)} episodes: {_named('layout', layouts)},"
        f" {_named('seed', seeds)}, exploration that decays per {_all(readings, ' and per ')}."
    )


def departure(letter: str) -> str:
    """The gap, its reading, the reason and the variant of one departure, in Markdown."""
    entry = DEPARTURES[letter]
    parts = {"The paper": entry.gap, "Here": entry.reading, "Why": entry.why}
    if entry.variant:
        parts["To run another reading"] = _options(entry.variant.split(", "))
    return "\n\n".join(f"{name}\n: {text}" for name, text in parts.items())


def _options(names: list[str]) -> str:
    """The fields of `Experiment` that choose a variant, with their defaults."""
    defaults = {field.name: field.default for field in fields(Experiment)}
    given = ", ".join(f"`{name}` (here `{defaults[name]!r}`)" for name in names)
    return f"Set {given}, as in `sweep({names[0]}=...)`."


def _table(caption: str, header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A table whose cells are HTML already."""
    left = 'scope="col" style="text-align: left"'  # the theme turns headers to the right
    head = "".join(f"<th {left}>{escape(name)}</th>" for name in header)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return (
        f'<table class="table dataframe"><caption>{escape(caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def _badge(text: str, style: str) -> str:
    return f'<span class="{style}">{text}</span>'


def _linked(text: str) -> str:
    """Turn the letter of a departure into a link to its entry."""
    return re.sub(r"\b(departure) ([A-Z])\b", r"\1 {ref}`\2 <departure-\2>`", text)


def _named(name: str, values: tuple[object, ...]) -> str:
    return f"{name}{'' if len(values) == 1 else 's'} {_all(values)}"


def _all(values: tuple[object, ...], glue: str = " and ") -> str:
    return glue.join(str(value) for value in values)
