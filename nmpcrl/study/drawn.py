"""Layouts and scenarios that were drawn and screened before any run.

Step sizes and thresholds are chosen in `TUNE`, the 60 layouts T01 to T60, and judged in `JUDGE`,
the 120 layouts J001 to J120. They are the first that a sampler drew with seed 24 and
`layouts.screen` accepted; a test draws them again.

Scenarios with moving obstacles, M01 to M40, are the first that were drawn with seed 25 and in which

1. a robot that sees no obstacle gets into one;
2. the start is clear in the first second, and the target in the last five: Upsilon = 0;
3. without noise, the NMPC with theta_init that knows the motion is at the target at the end.

`nmpcrl/studies/drawing.py` of commit 6386628 draws the scenarios again.
"""

import json
from pathlib import Path

from nmpcrl.study.experiment import LAYOUT
from nmpcrl.study.geometry import Centres
from nmpcrl.study.moving import KINDS, Motion

FOLDER = Path(__file__).parent
Scenario = tuple[Motion, ...]

POPULATION = json.loads((FOLDER / "population.json").read_text("utf-8"))
LAYOUTS: dict[str, Centres] = {
    name: tuple((x, y) for x, y in centres) for name, centres in POPULATION.items()
}
TUNE = {name: centres for name, centres in LAYOUTS.items() if name[0] == "T"}
JUDGE = {name: centres for name, centres in LAYOUTS.items() if name[0] == "J"}
# Numbers of the first 15 layouts of `JUDGE` of either kind; a test chooses them again.
CLOSING = (3, 4, 24, 29, 31, 32, 37, 44, 46, 50, 58, 65, 77, 82, 89)
OPEN = (1, 2, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17)
COMPARED = tuple(f"J{i:03}" for i in sorted(CLOSING + OPEN))  # with other horizons and step sizes


NAMES = {LAYOUT.read(centres): name for name, centres in LAYOUTS.items()}


def name_of(layout: str) -> str:
    """The name of a layout, given as a field of an `Experiment`; A to F are names."""
    return NAMES.get(layout, layout)


def _motion(kind: str, fields: dict[str, float | list[float]]) -> Motion:
    plain = {key: tuple(one) if isinstance(one, list) else one for key, one in fields.items()}
    return KINDS[kind](**plain)


SCENARIOS: dict[str, Scenario] = {
    name: tuple(_motion(*one) for one in scenario)
    for name, scenario in json.loads((FOLDER / "scenarios.json").read_text("utf-8")).items()
}
