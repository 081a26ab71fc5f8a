"""SAC and TD3 as they were trained once: `agents.json`.

It has by part and agent what each training came to, run by run in the order of
`agent_questions.PARTS`.
"""

from nmpcrl.claims.agent_runs import COLUMNS, order
from nmpcrl.claims.extendable import Arms, Extendable

FILE = "agents.json"
HELD = Extendable(FILE, "what SAC and TD3 learned", "nmpcrl agents --publish")
ARMS = Arms(HELD, COLUMNS, lambda part, arm: order(part), digits=6)
extend, load = ARMS.extend, ARMS.load
