"""Worlds that move, change, or are not the model, as they were run once: `worlds.json`.

It has by part and arm what was run there, run by run in the order of `world_runs.PARTS`.
"""

from nmpcrl.claims.extendable import Arms, Extendable
from nmpcrl.claims.world_questions import REMEDY
from nmpcrl.claims.world_runs import COLUMNS, PARTS

FILE = "worlds.json"
HELD = Extendable(FILE, "what was run in worlds that change", "nmpcrl world --publish")


def _runs(part: str, arm: str) -> tuple[tuple[str, int], ...]:
    """Place and number of the seed of each run."""
    return PARTS[part].runs(REMEDY if arm.startswith(REMEDY) else arm)


ARMS = Arms(HELD, COLUMNS, _runs, digits=5)
extend, load = ARMS.extend, ARMS.load
