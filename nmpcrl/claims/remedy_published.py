"""The comparison of remedies as it was run once: `suite.json`, beside the study.

It has J_init and J_best of each layout, and by entry, part and setting what was judged there, run
by run in the order of `remedy_questions.PARTS`: costs with seven digits, null where a solve failed;
one letter a run for whether the robot arrived; episodes, one number where all runs began as many;
and the processor time of all together.
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
from nmpcrl.claims.remedies import COLUMNS
from nmpcrl.claims.remedy_questions import PARTS

FILE = "suite.json"
HELD = Extendable(FILE, "the comparison of remedies", "nmpcrl remedies --publish")
ARRIVED = {True: "a", False: "-"}
DIGITS = 7


@dataclass(frozen=True, eq=False)
class Comparison:
    """What is published."""

    table: pd.DataFrame  # with `remedies.COLUMNS`
    about: Mapping[str, Any] = field(default_factory=dict)


def extend(table: pd.DataFrame) -> Path:
    """Publish whole parts of some entries beside those that are there, which stay as they are.

    Args:
        table: with `remedies.COLUMNS`; an entry's part that is published already is left out of it
            if it says the same.

    Returns:
        The file.

    Raises:
        Damaged: what is published is not what was written.
        Unpublishable: a part is not whole, or is published otherwise, or nothing is new.
    """
    content = HELD.begun(layouts={}, entries={})
    new = False
    for entry, part, name, runs in _blocks(table):
        block = _block(entry, part, runs)
        settings = content["entries"].setdefault(entry, {}).setdefault(part, {})
        if name in settings:
            if settings[name] | {"seconds": 0} != block | {"seconds": 0}:
                raise Unpublishable(f"{name} is published already in the part {part!r}, otherwise")
            continue
        if settings and part != "tune":
            raise Unpublishable(f"{entry} is published already in {part!r}, as {min(settings)}")
        settings[name], new = block, True
        _note(content["layouts"], runs)
    if not new:
        raise Unpublishable("nothing of the comparison is whole and new")
    path = HELD.write(content)
    _load.cache_clear()
    return path


def load() -> Comparison:
    """What is published of the comparison.

    Raises:
        Damaged: it is not there, or not what was written.
    """
    return _load(HELD.path)


def load_if_there() -> pd.DataFrame | None:
    """The table of what is published; None where nothing is.

    Raises:
        Damaged: it is not what was written.
    """
    return load().table if HELD.path.exists() else None


@cache
def _load(path: Path) -> Comparison:
    content = HELD.content(path)
    try:
        found = [
            row
            for entry, parts in content["entries"].items()
            for part, settings in parts.items()
            for name, block in settings.items()
            for row in _rows(entry, part, name, block, content["layouts"])
        ]
        return Comparison(pd.DataFrame(found, columns=[*COLUMNS]), {"made": content["about"]})
    except (ValueError, LookupError, TypeError) as error:
        raise HELD.damaged(path, error) from error


def _blocks(table: pd.DataFrame) -> Iterator[tuple[str, str, str, pd.DataFrame]]:
    """Entry, part, setting, and the runs of these."""
    for (entry, part, name), runs in table.groupby(["entry", "part", "name"], sort=False):
        yield str(entry), str(part), str(name), runs


def _order(entry: str, part: str) -> list[tuple[str, int]]:
    """Layout and number of the seed of each run."""
    one = PARTS[part]
    return [(layout, k) for layout in one.layouts_of(entry) for k in range(one.seeds)]


def _block(entry: str, part: str, runs: pd.DataFrame) -> dict[str, Any]:
    """The runs of one setting in one part.

    Raises:
        Unpublishable: they are not those of the part.
    """
    by = runs.set_index(["layout", "k"])
    order = _order(entry, part)
    if {*by.index} != {*order} or len(by) != len(order):
        raise Unpublishable(f"{entry} has {len(by)} of {len(order)} runs of the part {part!r}")
    there = by.loc[order]
    episodes = [int(one) for one in there.episodes]
    return {
        "cost": [rounded(cost, DIGITS) for cost in there.cost],
        "arrived": "".join(ARRIVED[bool(one)] for one in there.arrived),
        "episodes": episodes[0] if len({*episodes}) == 1 else episodes,
        "over": [i for i, over in enumerate(there.over) if over],
        "seconds": rounded(float(there.seconds.sum()), 4),
    }


def _note(layouts: dict[str, list[float | None]], runs: pd.DataFrame) -> None:
    """Keep J_init and J_best of each layout.

    Raises:
        Unpublishable: others are published.
    """
    for row in runs.drop_duplicates("layout").itertuples():
        known = [rounded(row.initial, DIGITS), rounded(row.best, DIGITS)]
        if layouts.setdefault(str(row.layout), known) != known:
            raise Unpublishable(f"layout {row.layout} is published with other costs to compare to")


def _rows(
    entry: str,
    part: str,
    name: str,
    block: Mapping[str, Any],
    layouts: Mapping[str, tuple[float, float]],
) -> Iterator[dict[str, Any]]:
    order, costs = _order(entry, part), block["cost"]
    begun = block["episodes"]
    letters = {letter: arrived for arrived, letter in ARRIVED.items()}
    for i, (where, cost, letter) in enumerate(zip(order, costs, block["arrived"], strict=True)):
        layout, k = where
        initial, best = layouts[layout]
        yield {
            "part": part, "entry": entry, "name": name, "layout": layout, "k": k,
            "initial": initial, "best": best, "cost": np.inf if cost is None else cost,
            "arrived": letters[letter], "over": i in block["over"],
            "episodes": begun[i] if isinstance(begun, list) else begun,
            "seconds": block["seconds"] / len(order),
        }  # fmt: skip
