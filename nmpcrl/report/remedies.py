"""The comparison of learners, remedies and searches as pages show it: tables, and answers."""

from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import Estimate, rate
from nmpcrl.claims.investigation import WORDS, Answer, Question
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.report.cited import Cited, cited
from nmpcrl.report.tables import BADGES, html_table
from nmpcrl.studies.remedies import (
    ADVISED,
    FIRST,
    LATER,
    NEVER,
    OPEN,
    PARTS,
    REMEDIES,
    SECOND,
    RemedyRow,
    rows,
    shares,
    solved,
)

COLOURS = {  # of a word, as of a verdict
    FIRST: REPRODUCED, SECOND: REPRODUCED, LATER: PARTLY, OPEN: UNDECIDABLE, NEVER: NOT,
}  # fmt: skip
NOTHING = "–"  # where an entry was not judged
BACK = "taken back where a rollout got worse"
COSTS, STEPS, MODEL = "costs of rollouts", "steps", "the plant's derivatives"
WHAT: dict[str, tuple[str, str]] = {  # what an entry is, and what it is told; in HTML
    "frozen": ("θ<sub>init</sub> as it is", "nothing"),
    "grid": ("a grid over θ<sub>c</sub> alone", COSTS),
    "ES": ("Expected Sarsa", STEPS),
    "GES": ("Expected Sarsa by gradient TD", STEPS),
    "TDC": ("exact nonlinear TDC", STEPS),
    "RDES": ("Expected Sarsa with a network that is given θ", STEPS),
    "DES": ("Expected Sarsa with a network", STEPS),
    "TDRC": ("gradient TD with one step size and a w that decays", STEPS),
    "GES-3": ("GES with a faster w, whose steps are normalised", STEPS),
    "guarded-ES": ("ES whose steps cannot overshoot", STEPS),
    "guarded-RDES": ("RDES whose steps cannot overshoot", STEPS),
    "control-RDES": ("steps as long as those of guarded RDES in the direction of ES", STEPS),
    "averaged-ES": ("the mean θ of the second half of ES", STEPS),
    "undone-ES": (f"ES, {BACK}", f"{STEPS}, {COSTS}"),
    "undone-LSTD-Q": (f"Gauss-Newton on the TD error, {BACK}", f"{STEPS}, {COSTS}"),
    "GN-J": ("Gauss-Newton on the cost of the closed loop", f"{STEPS}, {MODEL}"),
    "undone-GN-J": (
        f"Gauss-Newton on the cost of the closed loop, {BACK}", f"{STEPS}, {COSTS}, {MODEL}"
    ),
    "DPG": ("the deterministic policy gradient", STEPS),
    "SPSA": ("SPSA, a gradient from two rollouts", COSTS),
    "CMA-ES": ("a search of all nine numbers by CMA-ES", COSTS),
    "Bayes": ("Bayesian optimisation of all nine numbers", COSTS),
}  # fmt: skip


def advice_table(advised: pd.DataFrame, caption: str) -> str:
    """The table of `remedies.advice` in HTML, a row an entry, with evidence and price by budget."""
    judged = (PARTS[part] for part in ADVISED)
    budgets = (f"With {one.episodes} episodes (seeds a layout: {one.seeds})" for one in judged)
    header = ("Method", "Try it", *budgets)
    cells = (_cells(of_entry) for _, of_entry in advised.groupby("entry", sort=False))
    return html_table(caption, header, cells, headed=True)


def evidence(advised: pd.DataFrame, entry: str) -> dict[str, Any]:
    """What an entry is, and its evidence with the smaller budget, for a sentence."""
    row = next(advised[(advised.entry == entry) & (advised.part == ADVISED[0])].itertuples())
    what, _ = WHAT[entry]
    return {
        "name": f"`{entry}`", "what": what, "rollouts": str(row.rollouts),
        "gain": Cited(row.gain, f"share of the possible gain, {entry}, {row.part}: published"),
        "solved": Cited(row.solved, f"layouts solved, {entry}, {row.part}: published"),
    }  # fmt: skip


def named_table(table: pd.DataFrame, part: str) -> str:
    """One row an entry of a part with few layouts, in HTML, the control among them.

    Args:
        table: of `REMEDIES`.
        part: whose layouts are shown one by one.
    """
    found = rows(table[table.part == part])
    order = sorted(found, key=lambda row: (-np.nan_to_num(row.gain.value), row.seconds))
    one = PARTS[part]
    caption = (
        f"Share of the possible gain by layout with {one.episodes} episodes, mean of {one.seeds}"
        " seeds; in italics where not every seed solves the layout."
    )
    header = ("Method", *one.places, "Solved", "CPU time")
    by = ((row, table[(table.part == part) & (table.entry == row.entry)]) for row in order)
    return html_table(caption, header, (_named(row, runs) for row, runs in by), headed=True)


def _named(row: RemedyRow, runs: pd.DataFrame) -> tuple[str, ...]:
    share, ended = shares(runs), solved(runs)
    found = (
        (f"{share[one]:.2f}" if np.isfinite(share[one]) else "fails") if one in share else NOTHING
        for one in ended.index
    )
    each = [
        text.replace("-", "−") if well else f"<em>{text.replace('-', '−')}</em>"
        for text, well in zip(found, ended, strict=True)
    ]
    if row.disqualified:
        each = ["disqualified"] * len(ended)
    count = f"{ended.sum()} of {len(ended)}"
    return (entry_named(row.name), *each, count, f"{row.seconds:.1f} s")


def _cells(of_entry: pd.DataFrame) -> tuple[str, ...]:
    first, *others = of_entry.itertuples()
    known = {row.part: _evidence(row) for row in (first, *others)}
    what, told = WHAT[first.entry]
    return (
        entry_named(first.name),
        f'<span class="{BADGES[COLOURS[first.word]]}">{first.word}</span>'
        f"<br>{what}<br><small>learns from {told}</small>",
        *(known.get(part, NOTHING) for part in ADVISED),
    )


def _evidence(row: Any) -> str:
    """What it gained, and below that how many layouts it solves, and at which price."""
    of = f"{row.entry}, {row.part}: published"
    gain = cited(share_shown(row.gain), row.gain, f"share of the possible gain, {of}")
    well = cited(f"{row.solved.value:.0%} of {row.layouts}", row.solved, f"layouts solved, {of}")
    price = f"{row.rollouts} rollouts, {row.seconds:.1f} s"
    return f"{gain}<br><small>{well} layouts; {price}</small>"


def entry_named(name: str) -> str:
    """An entry, and below it what is set."""
    entry, bracket, setting = name.partition("[")
    below = f"<br><small>{escape(setting.rstrip(']'))}</small>" if bracket else ""
    return f"<code>{escape(entry)}</code>{below}"


def share_shown(share: Estimate) -> str:
    """With its interval; a quarter of failures or more is infinitely bad."""
    text = f"{share:.2f}" if np.isfinite(share.low) else f"{share.value:.2f} [{share.low:.2f}, …]"
    return text.replace("-0.00", "0.00").replace("-", "−").replace("inf", "∞")


def safest(advised: pd.DataFrame) -> list[str]:
    """The entries that solve every layout, at each budget at which they are judged."""
    every = advised.solved.map(lambda share: share.value == 1)
    by_entry = every.groupby(advised.entry, sort=False).all()
    return [*by_entry.index[by_entry]]


def answer_items(
    answers: Iterable[Answer],
    questions: Mapping[str, Question] = REMEDIES.asked,
    *,
    expected: bool = False,
) -> str:
    """One item a question, in Markdown: the pilot, the question, and what became of it.

    Args:
        answers: in the order in which they are shown.
        questions: of an investigation, by name.
        expected: whether to name the question, and the expected outcome where it is another.
    """
    return "\n".join(_item(one, questions[one.question], expected) for one in answers)


def _item(answer: Answer, asked: Question, expected: bool) -> str:
    """The pilot, the question, the outcome and its counts and numbers."""
    pilot = f"The pilot: “{asked.pilot}” " if asked.pilot else ""
    said = [f"{yes} of {of} {name}{_bounds(yes, of)}" for name, (yes, of) in answer.counts.items()]
    for name in ("difference", "correlation"):
        if name in answer.numbers:
            found = Estimate(*(answer.numbers[one] for one in (name, "low", "high")))
            said.append(f"the {name} is {share_shown(found)}")
    said += [f"{yes} of {of} {name}" for name, (yes, of) in answer.beside.items()]
    said += [f"{entry} has {', '.join(each)}" for entry, each in _by_layout(answer.numbers).items()]
    because = f": {'; '.join(said)}" if said else ""
    name = f" ({asked.name})" if expected else ""
    line = f"- {pilot}**{asked.question}**{name} {answer.words.capitalize()}{because}."
    if not expected or asked.expected == answer.outcome:
        return line
    return f"{line} Expected: {WORDS.get(asked.expected, asked.expected)}."


def _bounds(yes: int, of: int) -> str:
    """Wilson's interval of a share, as if what was counted were independent."""
    if not of:
        return ""
    share = rate(yes, of)
    return f" [{share.low:.0%}, {share.high:.0%}]"


def _by_layout(numbers: Mapping[str, float]) -> dict[str, list[str]]:
    """What an answer knows of single layouts: "CMA-ES in A", by entry."""
    by: dict[str, list[str]] = {}
    for name, share in numbers.items():
        entry, there, layout = name.partition(" in ")
        if there:
            shown = f"{share:.2f}".replace("-", "−") if np.isfinite(share) else "a failed solve"
            by.setdefault(entry, []).append(f"{shown} in {layout}")
    return by
