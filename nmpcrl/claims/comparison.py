"""Runs that were trained here beside published ones: equal to the last bit, or in their range."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.rows import FIELDS, THETA, row
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims.published import Published
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.provenance import environment, summary_key
from nmpcrl.study.records import Column
from nmpcrl.study.storage.machine import fingerprint

SEEDLESS = [name for name in FIELDS if name != "seed"]  # what a cell shares
CELL = ("learner", "layout", "decay")  # of these, what a table of contradictions shows
MEASURES = ("final_cost", "training_cost")  # by which runs of another machine are judged
SLACK = 0.01  # of theta_init's cost, that they may be out of the published range
FEWEST = 3  # runs of a cell that tell: one or two of a chaotic learner may fail by chance
EXACT = 1e-6  # relative: the cost of theta_init, which no noise and no learning moves


def compare(fresh: Mapping[Experiment, RunSummary], published: Published) -> pd.DataFrame:
    """Where runs that were trained here contradict the published ones: one row each, none if none.

    Where code, versions and machine are the same, every run must be the same to the last bit.
    Elsewhere rounding differs, and learning may make much of that. So theta_init's cost must agree
    to `EXACT`, and of `FEWEST` or more runs of a learner, layout and reading of the decay at least
    half must lie within the range of the published ones, widened on both sides by itself and by
    `SLACK`. Where none of ten published runs failed and each fails with a probability of p, most
    of three fail in at most 1.2 % of all cases, whatever p is; a single run would in 3.5 %.
    """
    rows = {e: row(one) for e, one in fresh.items() if e in published.rows}
    exact = comparable(rows, published)
    wrong = [unequal(e, rows[e], published.rows[e]) for e in sorted(exact, key=str)]
    others = {e: one for e, one in rows.items() if e not in exact}
    wrong += _out_of_range(others, published)
    names = [*CELL, "seed", "what", "here", "published"]
    return pd.DataFrame([one for one in wrong if one], columns=names)


def comparable(runs: Iterable[Experiment], published: Published) -> set[Experiment]:
    """Those of which code, versions and machine are the ones of the published runs."""
    mine, known = {"machine": fingerprint(), "versions": environment()}, published.rows
    here = {
        part: all(made.get(name) == value for name, value in mine.items())
        for made in published.batches
        for part in made.get("runs", {})
    }
    return {
        e
        for e in runs
        if e in known and here[published.variants[e]] and known[e]["key"] == summary_key(e)
    }


def unequal(
    e: Experiment, here: Mapping[str, Any], there: Mapping[str, Any]
) -> tuple[Any, ...] | None:
    """The first number in which two runs differ that should be the same."""
    for name in _compared(e):
        if here[name] != there[name]:
            return e.learner, e.layout, e.decay, e.seed, name, here[name], str(there[name])
    return None


def nearly_equal(e: Experiment, here: Mapping[str, Any], there: Mapping[str, Any]) -> bool:
    """Whether two runs agree to `EXACT` in all numbers in which they should be the same."""
    mine, theirs = ([float(one[name]) for name in _compared(e)] for one in (here, there))
    return bool(np.allclose(mine, theirs, rtol=EXACT, atol=EXACT))


def _compared(e: Experiment) -> list[str]:
    return [*MEASURES, "initial_cost", *THETA]


def _out_of_range(
    rows: Mapping[Experiment, dict[str, Any]], published: Published
) -> list[tuple[Any, ...]]:
    """The rule for runs of another machine; see `compare`."""
    wrong: list[tuple[Any, ...]] = []
    if not rows:
        return wrong
    known = pd.DataFrame([published.rows[e] for e in published.rows])
    cells = dict(list(known.groupby(SEEDLESS)))
    for named, group in pd.DataFrame(list(rows.values())).groupby(SEEDLESS):
        there, cell = cells[named], tuple(group[list(CELL)].iloc[0])
        start = float(there.initial_cost.iloc[0])
        for seed, here in zip(group.seed, group.initial_cost, strict=True):
            if abs(here / start - 1) > EXACT:
                wrong.append((*cell, seed, "initial_cost", here, str(start)))
        for name in MEASURES:
            low, high = _widened(there[name].to_numpy(float), SLACK * start)
            outside = ~group[name].between(low, high)
            if len(group) >= FEWEST and outside.mean() > 0.5:
                middle = float(group[name].median())
                wrong.append((*cell, "all", name, middle, f"{low:.1f} to {high:.1f}"))
    return wrong


def _widened(values: Column, slack: float) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return -np.inf, np.inf
    width = float(np.ptp(finite)) + slack
    most = np.inf if finite.size < values.size else float(finite.max()) + width
    return float(finite.min()) - width, most
