"""Worlds that move, change, or are not the model, as they were run once: `worlds.json`.

It has by part and arm what was run there, run by run in the order of `world_questions.PARTS`:
numbers with five digits, null where a solve failed, and the processor time of all together.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.claims.extendable import Extendable, rounded
from nmpcrl.claims.published import Unpublishable
from nmpcrl.claims.world_questions import PARTS, REMEDY
from nmpcrl.claims.world_runs import COLUMNS

FILE = "worlds.json"
HELD = Extendable(FILE, "what was run in worlds that change", "nmpcrl world --publish")
DIGITS = 5
PLAIN = ("inside", "collisions", "arrived", "events")


@dataclass(frozen=True, eq=False)
class Worlds:
    """What is published."""

    table: pd.DataFrame  # with `world_runs.COLUMNS`
    about: Mapping[str, Any] = field(default_factory=dict)


def extend(table: pd.DataFrame) -> Path:
    """Publish whole arms beside those that are there, which stay as they are.

    Args:
        table: with `world_runs.COLUMNS`; an arm that is published already is left out of it if it
            says the same.

    Returns:
        The file.

    Raises:
        Damaged: what is published is not what was written.
        Unpublishable: an arm is not whole, or is published otherwise, or nothing is new.
    """
    content, new = HELD.begun(parts={}), False
    for (part, arm), runs in table.groupby(["part", "arm"], sort=False):
        block, arms = _block(part, arm, runs), content["parts"].setdefault(part, {})
        if arm in arms:
            if arms[arm] | {"seconds": 0} != block | {"seconds": 0}:
                raise Unpublishable(f"{arm} is published already in the part {part!r}, otherwise")
            continue
        arms[arm], new = block, True
    if not new:
        raise Unpublishable("nothing of these worlds is whole and new")
    path = HELD.write(content)
    _load.cache_clear()
    return path


def load() -> Worlds:
    """What is published.

    Raises:
        Damaged: it is not there, or not what was written.
    """
    return _load(HELD.path)


@cache
def _load(path: Path) -> Worlds:
    content = HELD.content(path)
    try:
        rows = [
            row
            for part, arms in content["parts"].items()
            for arm, block in arms.items()
            for row in _rows(part, arm, block)
        ]
        return Worlds(pd.DataFrame(rows, columns=[*COLUMNS]), {"made": content["about"]})
    except (ValueError, LookupError, TypeError) as error:
        raise HELD.damaged(path, error) from error


def _order(part: str, arm: str) -> tuple[tuple[str, int], ...]:
    """Place and number of the seed of each run."""
    return PARTS[part].runs(REMEDY if arm.startswith(REMEDY) else arm)


def _block(part: str, arm: str, runs: pd.DataFrame) -> dict[str, Any]:
    """The runs of one arm.

    Raises:
        Unpublishable: they are not those of the part.
    """
    by, order = runs.set_index(["place", "k"]), list(_order(part, arm))
    if {*by.index} != {*order} or len(by) != len(order):
        raise Unpublishable(f"{arm} has {len(by)} of {len(order)} runs of the part {part!r}")
    there = by.loc[order]
    return {
        "cost": [rounded(one, DIGITS) for one in there.cost],
        "series": [[rounded(one, DIGITS) for one in each] for each in there.series],
        **{name: there[name].tolist() for name in PLAIN},
        "seconds": rounded(float(there.seconds.sum()), 4),
    }


def _rows(part: str, arm: str, block: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    order = _order(part, arm)
    for i, (place, k) in enumerate(order):
        yield {
            "part": part, "arm": arm, "place": place, "k": k,
            "cost": _read(block["cost"][i]), "series": [_read(one) for one in block["series"][i]],
            **{name: block[name][i] for name in PLAIN}, "seconds": block["seconds"] / len(order),
        }  # fmt: skip


def _read(value: float | None) -> float:
    return np.inf if value is None else value
