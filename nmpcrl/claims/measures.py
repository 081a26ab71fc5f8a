"""The number behind each claim that runs decide, one a run: to be drawn, and held against borders.

`claims` puts its questions to whole runs; here is what the questions look at.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pandas as pd

from nmpcrl.analysis.metrics import TOUCH
from nmpcrl.analysis.statistics import rate
from nmpcrl.claims import paper_claims
from nmpcrl.claims.paper_claims import Paths, experiment_of
from nmpcrl.claims.rule import CELL, arms, read
from nmpcrl.study.experiment import PAPER

# One row a cell of layout, decay and seed, one column an arm; nan is unknown.
Values: TypeAlias = pd.DataFrame


@dataclass(frozen=True)
class Measure:
    """What a claim is decided by, and where yes ends."""

    label: str  # of an axis
    border: float  # as fixed in `claims`
    of: Callable[[pd.DataFrame, Paths], Values]
    contrast: bool = False  # asked: is the first arm above the border, and the second not?
    at_least: bool = False  # asked of each number: is it at least the border? Else: at most?
    nothing: float = 0.0  # the number of a run in which nothing is to be seen


def holds(measure: Measure, values: Values, border: float | None = None) -> pd.Series:
    """Yes or no for each number, or pair of numbers, that is known.

    Args:
        measure: of a claim.
        values: of `measure.of`.
        border: another one than the claim's.
    """
    limit = measure.border if border is None else border
    if measure.contrast:
        first, second = (values.dropna()[name] for name in values)
        return (first > limit) & (second <= limit)
    numbers = values.stack().dropna()
    return numbers >= limit if measure.at_least else numbers <= limit


def at_borders(measure: Measure, values: Values, borders: Iterable[float]) -> pd.DataFrame:
    """What would become of a claim at other borders than its own, which stays where it is.

    Returns:
        Columns border, share (of yes), low and high (its interval) and outcome, by the rule of
        `verdicts` for those that are known; no row where none is.
    """
    rows = []
    for border in borders:
        answers = holds(measure, values, border)
        if len(answers):
            yes, of = int(answers.sum()), len(answers)
            share = rate(yes, of)
            rows.append((border, share.value, share.low, share.high, read(yes, of)))
    names = ["border", "share", "low", "high"]
    return pd.DataFrame(rows, columns=[*names, "outcome"]).astype(dict.fromkeys(names, float))


def steady(measure: Measure, values: Values) -> bool:
    """Whether the verdict stays with a border half and twice as far from nothing."""
    far = measure.border - measure.nothing
    around = measure.nothing + far * np.array([0.5, 1.0, 2.0])
    return at_borders(measure, values, around).outcome.nunique() <= 1


def saved(runs: pd.DataFrame) -> pd.Series:
    """Share of theta_init's noise-free cost that each run of `summary.table` saves in the end.

    Minus infinity where a drive failed, and where training had to be stopped.
    """
    return paper_claims.gain(runs).where(runs.stopped == "finished", -np.inf)


def achieved(runs: pd.DataFrame, possible: Mapping[str, float]) -> pd.Series:
    """Share of what is possible in its layout that each run saves in the end.

    1 is as good as what is possible and 0 as theta_init; nan where nothing is known to be possible.

    Args:
        runs: of `summary.table`.
        possible: share of theta_init's noise-free cost that can be saved, by layout.
    """
    known = {layout: share for layout, share in possible.items() if share > 0}
    return saved(runs) / runs.layout.map(known).astype(float)


def _cost_ratio(runs: pd.DataFrame, _: Paths) -> Values:
    """Training cost over the frozen arm's; infinite where the run was stopped."""

    def cost_ratio(arm: pd.DataFrame) -> pd.Series:
        return arm.cost_ratio.mask(arm.stopped.notna() & (arm.stopped != "finished"), np.inf)

    return _beside(runs, ("DES", "RDES"), cost_ratio)


def _late_cost_range(runs: pd.DataFrame, _: Paths) -> Values:
    """Range of the noise-free cost over theta_init's; infinite where the run diverged."""

    def late_cost_range(arm: pd.DataFrame) -> pd.Series:
        diverged = paper_claims.divergence(arm)
        return arm.late_cost_range.mask(diverged.fillna(False).astype(bool), np.inf).where(
            diverged.notna()
        )

    return _beside(runs, ("ES", "GES"), late_cost_range)


def _apart(runs: pd.DataFrame, paths: Paths) -> Values:
    """How far RDES and GES are apart, in paths or in costs, whichever is more.

    In shares of `SAME_PATH` and `SAME_COST`; infinite where a drive failed or a run was stopped.
    """
    rdes, ges = arms(runs, "RDES", "GES")
    drives = {
        (row["learner"], *(row[name] for name in CELL)): paths.get(experiment_of(row))
        for row in runs[runs.learner.isin(("RDES", "GES"))].to_dict("records")
    }
    pairs = [(drives.get(("RDES", *c)), drives.get(("GES", *c))) for c in rdes.index]
    known = np.array([one is not None and other is not None for one, other in pairs], bool)
    path = pd.Series([paper_claims.apart(*pair) for pair in pairs], rdes.index, dtype=float)
    cost = paper_claims.costlier(rdes, ges).abs()
    worse = np.maximum(path / paper_claims.SAME_PATH, cost / paper_claims.SAME_COST).fillna(np.inf)
    worse = worse.mask(np.isinf(rdes.final_cost), np.inf)  # two that failed are not the same
    whole = rdes.stopped.notna() & ges.stopped.notna()
    return pd.DataFrame({"RDES and GES": worse.where(whole & known)})


def _told(runs: pd.DataFrame, _: Paths) -> Values:
    """Held-out error of the network that is told theta over that of the one that is not."""
    return _beside(
        runs, ("RDES",), lambda arm: arm.imitation_with / arm.imitation_without, among=PAPER
    )


def _inside(runs: pd.DataFrame, _: Paths) -> Values:
    """Largest Xi of the drives without noise, 0 if none was above; infinite for a wrong input."""
    return _beside(
        runs, PAPER, lambda arm: arm.eval_worst_overlap.clip(lower=0).mask(arm.inputs > 0, np.inf)
    )


def _gain(runs: pd.DataFrame, _: Paths) -> Values:
    """Share of theta_init's noise-free cost that is saved in the end."""
    return _beside(runs, ("RDES", "GES"), paper_claims.gain)


def _beside(
    runs: pd.DataFrame,
    learners: tuple[str, ...],
    number: Callable[[pd.DataFrame], pd.Series],
    *,
    among: tuple[str, ...] = (),
) -> Values:
    """A number of each learner's runs, side by side."""
    found = arms(runs, *learners, among=among)
    return pd.DataFrame(
        {name: number(arm).astype(float) for name, arm in zip(learners, found, strict=True)}
    )


MEASURES = {  # of C7, its weaker question: the stronger one has no border to speak of
    "C1": Measure(
        "training cost / frozen arm's",
        paper_claims.DIVERGED,
        _cost_ratio,
        contrast=True,
        nothing=1.0,
    ),
    "C2": Measure(
        "range of noise-free cost", paper_claims.UNSTABLE, _late_cost_range, contrast=True
    ),
    "C5": Measure("apart / what counts as the same", 1.0, _apart),
    "C6": Measure("error with θ / without", paper_claims.MORE_ACCURATE, _told, nothing=1.0),
    "C7": Measure("largest Ξ without noise", TOUCH, _inside),
    "C9": Measure("fall of noise-free cost", paper_claims.BETTER, _gain, at_least=True),
}
