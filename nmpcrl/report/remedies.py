"""The comparison of learners, remedies and searches as pages show it: tables."""

from html import escape
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.report.cited import Cited
from nmpcrl.report.tables import badge, shown
from nmpcrl.studies.remedies import (
    ADVISED,
    FIRST,
    LATER,
    NEVER,
    OPEN,
    PARTS,
    SECOND,
    rows,
    shares,
    solved,
)

COLOURS = {  # of a word, as of a verdict
    FIRST: REPRODUCED, SECOND: REPRODUCED, LATER: PARTLY, OPEN: UNDECIDABLE, NEVER: NOT,
}  # fmt: skip
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
    rows = {}
    for entry, found in advised.groupby("entry", sort=False):
        what, told = WHAT[entry]
        known = {row.part: _evidence(row) for row in found.itertuples()}
        name, word = escape(found.name.iloc[0]).replace("[", "<br>["), found.word.iloc[0]
        rows[f"<code>{name}</code>"] = {
            "try it": f"{badge(word, COLOURS[word])}<br>{what}<br><small>learns from {told}</small>"
        } | {
            f"with {PARTS[part].episodes} episodes (seeds a layout: {PARTS[part].seeds})":
            known.get(part, "–") for part in ADVISED
        }  # fmt: skip
    return shown(pd.DataFrame.from_dict(rows, "index"), caption, escape=False)


def _evidence(row: Any) -> str:
    """What it gained, and below that how many layouts it solves, and at which price."""
    gain, solves = _cited(row)
    price = f"{row.rollouts} rollouts, {row.seconds:.1f} s"
    return f"{gain:.2f}<br><small>{solves:.0%} of {row.layouts} layouts; {price}</small>"


def _cited(row: Any) -> tuple[Cited, Cited]:
    of = f"{row.entry}, {row.part}: published"
    gain = Cited(row.gain, f"share of the possible gain, {of}")
    return gain, Cited(row.solved, f"layouts solved, {of}")


def evidence(advised: pd.DataFrame, entry: str) -> dict[str, Any]:
    """What an entry is, and its evidence with the smaller budget, for a sentence."""
    row = next(advised[(advised.entry == entry) & (advised.part == ADVISED[0])].itertuples())
    gain, solves = _cited(row)
    about = {"name": f"`{entry}`", "what": WHAT[entry][0], "rollouts": str(row.rollouts)}
    return about | {"gain": gain, "solved": solves}


def named_table(table: pd.DataFrame, part: str) -> pd.DataFrame:
    """Shares of the possible gain in the layouts of a part, a row an entry, the greatest first.

    A star marks a layout that not every seed solves.

    Args:
        table: of `REMEDIES`.
        part: whose layouts are shown one by one.
    """
    found = table[table.part == part]
    shown = {}
    every = rows(found).itertuples()
    for row in sorted(every, key=lambda row: (-np.nan_to_num(row.gain.value), row.seconds)):
        runs = found[found.entry == row.entry]
        ended = solved(runs)
        each = shares(runs).reindex(ended.index).map("{:.2f}".format).replace("-inf", "fails")
        count = {"solved": f"{ended.sum()} of {len(ended)}", "CPU time [s]": f"{row.seconds:.1f}"}
        shown[row.name] = (each + np.where(ended, "", "*")).to_dict() | count
    return pd.DataFrame.from_dict(shown, "index")
