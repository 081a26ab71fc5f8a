"""Worlds that move, change, or are not the model, as a chapter shows them."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.encounters import Encounters
from nmpcrl.analysis.suite import leaderboard
from nmpcrl.claims.investigation import Answer
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.report.cited import cited
from nmpcrl.report.remedies import answer_items, entry_named
from nmpcrl.report.tables import html_table
from nmpcrl.studies import worlds
from nmpcrl.studies.worlds import FAULTS, PARTS, VIEWS, WORLD_QUESTIONS, WORLDS
from nmpcrl.study import paper
from nmpcrl.study.moving import CLEARANCE, Motion, centres

OWN = ("oracle", "ES", "ES+model", "grid")  # policies of a wrong model that are compared
ENTRY = {"init": "frozen", "ES": "ES", "grid": "grid", "CMA-ES": "CMA-ES"}  # by policy
SEES = {  # what plans take of the obstacles, by view; the suite's robot extrapolates
    "extrapolated": "the velocity just seen", "known": "the motion", "frozen": "the place",
}  # fmt: skip


def saved(table: pd.DataFrame) -> pd.DataFrame:
    """The share of theta_init's cost that each policy saves, by fault and layout."""
    found = pd.DataFrame({how: worlds.saved(table, how) for how in OWN})
    return found.reindex(FAULTS, level=0)


def decided(answers: Iterable[Answer]) -> dict[str, str]:
    """How many of `WORLD_QUESTIONS` are answered how."""
    asked = {one.name for one in WORLD_QUESTIONS}
    outcomes = [one.outcome for one in answers if one.question in asked]
    return {
        "asked": str(len(outcomes)),
        "confirmed": str(outcomes.count(REPRODUCED)),
        "partly": str(outcomes.count(PARTLY)),
        "contradicted": str(outcomes.count(NOT)),
    }


def signed(share: float) -> str:
    """A change, such as +0.4%."""
    return f"{share:+.1%}".replace("-", "−")


def deepest(one: Encounters, motions: Sequence[Motion]) -> float:
    """How far inside an obstacle the robot gets at most [m]; 0 if it never does."""
    return float(max(0.0, -nearest(one, motions).min()))


def nearest(one: Encounters, motions: Sequence[Motion]) -> Vector:
    """The distance from the robot to the nearest obstacle at each step, below 0 inside it [m]."""
    states = one.states[: paper.STEPS, :2]
    away = np.linalg.norm(states[:, None] - centres(motions, np.arange(len(states))), axis=2)
    distances: Vector = away.min(axis=1) - CLEARANCE / 2
    return distances


def answered(answers: Iterable[Answer]) -> str:
    """The questions that published runs answer, one item each, in Markdown."""
    there = [one for one in answers if one.outcome != UNDECIDABLE]
    return answer_items(there, WORLDS.asked, expected=True)


def suite_rows(table: pd.DataFrame) -> dict[tuple[str, str], Any]:
    """By view and policy the suite's row of published runs among moving obstacles.

    Args:
        table: of `studies.worlds`.
    """
    there = table[table.part == "moving"]
    found = {}
    for view in VIEWS:
        initial = there[there.arm == f"{view} init"].set_index("place").cost
        for policy, entry in ENTRY.items():
            own = there[there.arm == f"{view} {policy}"]
            begun = PARTS["moving"].episodes if policy != "init" else 0
            judged = own.assign(
                entry=entry, initial=own.place.map(initial), episodes=begun, over=False
            )
            if len(judged):
                (found[view, policy],) = leaderboard(judged).itertuples()
    return found


def suite_table(table: pd.DataFrame) -> str:
    """`suite_rows` in HTML, those of the suite's own robot first."""
    found = suite_rows(table)
    header = ("Entry", "Plans with", "Solved", "Gain", "Never inside")
    caption = f"Among obstacles that move, with {PARTS['moving'].episodes} episodes a scenario."
    rows = (
        (entry_named(found[view, policy].entry), sees, *_shares(view, found[view, policy]))
        for view, sees in SEES.items()
        for policy in ENTRY
        if (view, policy) in found
    )
    return html_table(caption, header, rows, headed=True)


def _shares(view: str, row: Any) -> list[str]:
    shares = {"solved": row.solved, "gain": row.gain, "never inside": row.clear}
    return [
        cited(f"{one:.1%}" if name == "gain" else f"{one:.0%}", one,
              f"{name}, {row.entry}, {view} view: published").replace("-", "−")
        for name, one in shares.items()
    ]  # fmt: skip
