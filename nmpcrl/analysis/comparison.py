"""Two runs side by side: in which fields they differ, and how far their numbers are apart."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from nmpcrl.study.experiment import Experiment
from nmpcrl.study.paper import THETA_NAMES
from nmpcrl.study.records import Column, Records

CLOCKS = ("seconds", "solve_seconds", "fit_seconds")  # columns that no two runs share


@dataclass(frozen=True)
class Comparison:
    """What `compare` found."""

    fields: dict[str, tuple[Any, Any]]  # those that differ
    differing: tuple[str, ...]  # columns, "table/name", whose bits are not the same
    theta: tuple[float, str, int] | None  # largest difference, of which component, in which episode
    cost: tuple[float, int] | None  # largest difference of a rollout without noise, after how many

    @property
    def same_bits(self) -> bool:
        """Whether all numbers but the clocks' are the same."""
        return not self.differing

    @property
    def warning(self) -> str:
        """Why the costs of the two mean different things, or ""."""
        apart = [
            name for name in ("layout", "start", "target", "steps", "box") if name in self.fields
        ]
        return f"the costs are not comparable: other {' and '.join(apart)}" * bool(apart)


def compare(a: Records, b: Records) -> Comparison:
    """Compare two runs, as far as both go."""
    first, second = vars(Experiment(**a.experiment)), vars(Experiment(**b.experiment))
    pairs = {name: (value, second[name]) for name, value in first.items()}
    return Comparison(
        {name: pair for name, pair in pairs.items() if pair[0] != pair[1]},
        tuple(_differing(a, b)),
        _theta(a, b),
        _cost(a, b),
    )


def _differing(a: Records, b: Records) -> list[str]:
    """The columns that are not the same to the last bit."""
    found = []
    for table in ("steps", "evaluations"):
        first, second = getattr(a, table), getattr(b, table)
        for name in sorted({*first, *second} - set(CLOCKS)):
            if name not in first or name not in second or not _same(first[name], second[name]):
                found.append(f"{table}/{name}")
    return found


def _same(a: Column, b: Column) -> bool:
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def _theta(a: Records, b: Records) -> tuple[float, str, int] | None:
    """Step by step, over the steps that both took."""
    count = min(len(a.steps["theta"]), len(b.steps["theta"]))
    apart = np.abs(a.steps["theta"][:count] - b.steps["theta"][:count])
    if not np.isfinite(apart).any():
        return None
    step, component = np.unravel_index(np.nanargmax(apart), apart.shape)
    episode = int(a.steps["episode"][step]) + 1
    return float(apart[step, component]), THETA_NAMES[int(component)], episode


def _cost(a: Records, b: Records) -> tuple[float, int] | None:
    """After the episodes for which both were judged."""
    episodes, first, second = np.intersect1d(
        a.evaluations["episode"], b.evaluations["episode"], return_indices=True
    )
    apart = np.abs(a.evaluations["cost"][first] - b.evaluations["cost"][second])
    known = np.isfinite(apart)
    if not known.any():
        return None
    worst = int(np.argmax(np.where(known, apart, -1.0)))
    return float(apart[worst]), int(episodes[worst])
