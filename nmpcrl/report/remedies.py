"""What to try where learning fails, as a page shows it: the table of advice, and the answers."""

from collections.abc import Iterable, Mapping
from html import escape

import numpy as np

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.claims.population import Answer
from nmpcrl.claims.remedies import Advice, RemedyRow
from nmpcrl.claims.remedy_questions import (
    ADVICE,
    ADVISED,
    FIRST,
    LATER,
    NEVER,
    OPEN,
    PARTS,
    REMEDY_QUESTIONS,
    SECOND,
)
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.report.cited import cited
from nmpcrl.report.tables import BADGES, html_table
from nmpcrl.report.text import listed

COLOURS = {  # of a word, as of a verdict
    FIRST: REPRODUCED, SECOND: REPRODUCED, LATER: PARTLY, OPEN: UNDECIDABLE, NEVER: NOT,
}  # fmt: skip
NOTHING = "–"  # where an entry was not judged


def advice_table(advice: Iterable[Advice], caption: str) -> str:
    """One row an entry, in HTML: whether to try it, and its evidence and price by budget.

    Args:
        advice: of `remedies.advice`, in its order.
        caption: of the table.
    """
    header = ("Entry", "Try it", *(f"With {PARTS[part].budget} episodes" for part in ADVISED))
    return html_table(caption, header, map(_cells, advice), headed=True)


def part_table(rows: Iterable[RemedyRow], caption: str) -> str:
    """One row an entry of a part, in HTML, the control among them; the greatest lower end first.

    Args:
        rows: of `remedies.rows`.
        caption: of the table.
    """
    order = sorted(rows, key=lambda row: (np.isnan(row.gain.low), -row.gain.low, row.seconds))
    header = ("Entry", "Share of the possible gain", "Layouts solved", "Rollouts", "CPU time")
    return html_table(caption, header, map(_part_cells, order), headed=True)


def _part_cells(row: RemedyRow) -> tuple[str, ...]:
    evidence = ("disqualified",) * 2 if row.disqualified else (_gain(row), _solved(row))
    return (_name(row.name), *evidence, f"{row.rollouts}", f"{row.seconds:.1f} s")


def _cells(one: Advice) -> tuple[str, ...]:
    judged = [one.rows.get(part) for part in ADVISED]
    (known, *_) = [row for row in judged if row]
    return (
        _name(known.name),
        f'<span class="{BADGES[COLOURS[one.word]]}">{one.word}</span>',
        *(_evidence(row) if row else NOTHING for row in judged),
    )


def _evidence(row: RemedyRow) -> str:
    """What it gained, and below that how many layouts it solves, and at which price."""
    price = f"{row.rollouts} rollouts, {row.seconds:.1f} s"
    return f"{_gain(row)}<br><small>{_solved(row)} layouts; {price}</small>"


def _name(name: str) -> str:
    """An entry, and below it what is set."""
    entry, bracket, setting = name.partition("[")
    below = f"<br><small>{escape(setting.rstrip(']'))}</small>" if bracket else ""
    return f"<code>{escape(entry)}</code>{below}"


def _gain(row: RemedyRow) -> str:
    """The share of the possible gain with its interval."""
    what = f"share of the possible gain, {row.entry}, {row.part}: published"
    return cited(_shown(row.gain), row.gain, what)


def _shown(share: Estimate) -> str:
    """With its interval; a quarter of failures or more is infinitely bad."""
    text = f"{share:.2f}" if np.isfinite(share.low) else f"{share.value:.2f} [{share.low:.2f}, …]"
    return text.replace("-", "−").replace("inf", "∞")


def _solved(row: RemedyRow) -> str:
    what = f"layouts solved, {row.entry}, {row.part}: published"
    return cited(f"{row.solved.value:.0%} of {row.layouts}", row.solved, what)


def rule() -> str:
    """How the words of the table follow from its rows, in Markdown: one item a word."""
    return "\n".join(f"- **{word}**: {when}." for word, when in ADVICE.items())


def in_short(advice: Iterable[Advice]) -> str:
    """The advice in a sentence or two: what to try first, second, and never."""
    by: dict[str, list[str]] = {}
    for one in advice:
        by.setdefault(one.word, []).append(f"`{one.entry}`")
    said = [f"Try {by[FIRST][0]} first" if FIRST in by else "Nothing compared surely gains"]
    if SECOND in by:
        said[0] += f" and {by[SECOND][0]} second"
    if NEVER in by:
        said.append(f"Never try {listed(by[NEVER])}")
    return f"{'. '.join(said)}."


def expectation_items(expected: Mapping[str, bool]) -> str:
    """One item a sentence that was expected, in Markdown, and whether it came true."""
    return "\n".join(
        f"- Expected: {said}. {'So it is.' if true else 'It is not so.'}"
        for said, true in expected.items()
    )


def answer_items(answers: Iterable[Answer]) -> str:
    """One item a question, in Markdown: the pilot, the question, and what became of it."""
    return "\n".join(_item(one) for one in answers)


def _item(answer: Answer) -> str:
    asked = REMEDY_QUESTIONS[answer.question]
    pilot = f" The pilot: “{asked.pilot}”" if asked.pilot else ""
    said = [f"{yes} of {of} {name}" for name, (yes, of) in answer.counts.items()]
    if "difference" in answer.numbers:
        found = Estimate(*(answer.numbers[name] for name in ("difference", "low", "high")))
        said.append(f"the difference is {_shown(found)}")
    return f"- **{asked.question}** {answer.words.capitalize()}: {'; '.join(said)}.{pilot}"
