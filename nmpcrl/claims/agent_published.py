"""SAC and TD3 as they were trained once: `agents.json`.

It has by part and agent what each training came to, run by run in the order of
`agent_questions.PARTS`.
"""

from dataclasses import fields

from nmpcrl.analysis.agent_curves import Curve
from nmpcrl.claims.agent_questions import PARTS
from nmpcrl.claims.extendable import RUN, Arms, Extendable

FILE = "agents.json"
COLUMNS = (*RUN, *(one.name for one in fields(Curve)))
HELD = Extendable(FILE, "what SAC and TD3 learned", "nmpcrl agents --publish")


def order(part: str) -> tuple[tuple[str, int], ...]:
    """Place and number of the seed of each run of an arm."""
    return tuple((place, k) for place in PARTS[part].places for k in range(PARTS[part].seeds))


ARMS = Arms(HELD, COLUMNS, lambda part, arm: order(part), digits=6)
extend, load = ARMS.extend, ARMS.load
