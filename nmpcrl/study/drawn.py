"""Layouts and scenarios that `studies.drawing` drew, before anything was run in them.

There are 60 layouts to tune on, T01 to T60, and 120 to judge on, J001 to J120. Whatever is chosen
(a step size, a threshold of a predictor) is chosen on `TUNE`, and judged on `JUDGE`. Scenarios with
obstacles that move are M01 to M40.
"""

import json
from pathlib import Path
from typing import Any

from nmpcrl.study.geometry import Centres
from nmpcrl.study.moving import KINDS, Motion

FOLDER = Path(__file__).parent
Scenario = tuple[Motion, ...]


def _read(name: str) -> dict[str, Any]:
    """A JSON file of the package."""
    found: dict[str, Any] = json.loads((FOLDER / name).read_text("utf-8"))
    return found


LAYOUTS: dict[str, Centres] = {
    name: tuple((x, y) for x, y in centres) for name, centres in _read("population.json").items()
}
TUNE = {name: centres for name, centres in LAYOUTS.items() if name[0] == "T"}
JUDGE = {name: centres for name, centres in LAYOUTS.items() if name[0] == "J"}


def _motion(kind: str, fields: dict[str, float | list[float]]) -> Motion:
    plain = {key: tuple(one) if isinstance(one, list) else one for key, one in fields.items()}
    return KINDS[kind](**plain)


SCENARIOS: dict[str, Scenario] = {
    name: tuple(_motion(*one) for one in scenario)
    for name, scenario in _read("scenarios.json").items()
}
