"""Figures that a reader moves: the solver as WebAssembly, a problem, and the scripts that draw.

What a cell displays is whole: it works wherever a notebook's output runs scripts. The
book's driver, in `book/driver/page/live.py`, puts the scripts into files that the pages share.
Without scripts a page shows nothing of it, and a notebook that is not trusted, which leaves
`hidden` out, its sentence.
"""

from nmpcrl.report.live.closed_loop import controller
from nmpcrl.report.live.expected_sarsa import gradient, kink, update
from nmpcrl.report.live.introduction import intro
from nmpcrl.report.live.moving_obstacles import moving
from nmpcrl.report.live.published_runs import runs
from nmpcrl.report.live.training import laboratory
from nmpcrl.report.live.two_learners import learners, networks
from nmpcrl.report.live.two_states import chain

__all__ = [
    "chain",
    "controller",
    "gradient",
    "intro",
    "kink",
    "laboratory",
    "learners",
    "moving",
    "networks",
    "runs",
    "update",
]
