"""Values of the library as plain JSON: floats to the last digit, long tables as hashes."""

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

SENTENCES = {"statement", "evidence", "would_change", "each", "said", "question", "theorem", "here"}
CPUINFO = Path("/proc/cpuinfo")


def plain(value: Any, digits: int | None = None) -> Any:
    """A value as JSON can hold it; of a dataclass the fields that are no sentences.

    Args:
        value: a number, a table, a tuple with names, a dataclass, or any nesting of these.
        digits: to how many significant digits floats are rounded; all of them by default.
    """
    if isinstance(value, Enum):
        return str(value)
    if value is None or value is pd.NA or isinstance(value, str | bool):
        return None if value is pd.NA else value
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        number = float(value)
        if digits and math.isfinite(number):
            number = float(f"{number:.{digits}g}")
        return number if math.isfinite(number) else str(number)
    if is_dataclass(value):
        names = [one.name for one in fields(value) if one.name not in SENTENCES]
        return {name: plain(getattr(value, name), digits) for name in names}
    if hasattr(value, "_asdict"):
        return plain(value._asdict(), digits)
    if isinstance(value, pd.DataFrame):
        return {plain_name(name): plain(row, digits) for name, row in value.iterrows()}
    if isinstance(value, Mapping | pd.Series):
        return {plain_name(name): plain(one, digits) for name, one in value.items()}
    return [plain(one, digits) for one in value]


def plain_name(name: Any) -> str:
    """The name of a row or of an entry; the parts of one with several lie between blanks."""
    return " ".join(map(str, name)) if isinstance(name, tuple) else str(name)


def table(frame: pd.DataFrame | pd.Series) -> dict[str, Any]:
    """The number of rows and a hash of each column: every cell, in the order of the rows."""
    return {
        "rows": len(frame),
        "columns": {
            str(name): short([_cell(one) for one in column])
            for name, column in pd.DataFrame(frame).items()
        },
    }


def short(value: Any) -> str:
    """A hash of what JSON can hold."""
    return hashlib.sha256(json.dumps(value).encode()).hexdigest()[:16]


def _cell(value: Any) -> Any:
    """A cell of a table: 3 and 3.0 are the same number, and all that is missing is the same."""
    if isinstance(value, list | tuple | np.ndarray):
        return [_cell(one) for one in value]
    if value is None or value is pd.NA:
        return "nan"
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | float | np.integer | np.floating):
        return repr(float(value))
    return str(value)


def processor() -> str:
    """A hash of what the processor can do, on which the last digits of some numbers depend."""
    told = CPUINFO.read_text().splitlines() if CPUINFO.exists() else []
    return short(sorted({one for one in told if one.startswith(("flags", "Features"))}))


def differing(now: Any, then: Any, tolerance: float = 0.0) -> list[str]:
    """Where two plain values differ, a line each; floats by more than a relative tolerance."""
    one, other = (dict(_leaves(value)) for value in (now, then))
    return [
        f"{where}: {one.get(where, 'nothing')!r} now, {other.get(where, 'nothing')!r} as frozen"
        for where in one | other
        if not _alike(one.get(where, ...), other.get(where, ...), tolerance)
    ]


def _leaves(value: Any, where: str = "") -> Iterator[tuple[str, Any]]:
    named = value.items() if isinstance(value, dict) else enumerate(value)
    for name, one in named:
        if one and isinstance(one, dict | list):
            yield from _leaves(one, f"{where}/{name}")
        else:
            yield f"{where}/{name}", one


def _alike(one: Any, other: Any, tolerance: float) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=tolerance, abs_tol=tolerance)
    return type(one) is type(other) and one == other
