"""Figures that a reader moves: the solver as WebAssembly, a problem, and the scripts that draw.

What a cell displays is whole: it works wherever a notebook's output runs scripts. The
book's driver, in `book/driver/page/live.py`, puts the scripts into files that the pages share.
Without scripts a page shows nothing of it, and a notebook that is not trusted, which leaves
`hidden` out, its sentence.
"""

from nmpcrl.report.live.figures import chain, controller, gradient, moving
from nmpcrl.report.live.learning import intro, laboratory
from nmpcrl.report.live.published_runs import runs

__all__ = ["chain", "controller", "gradient", "intro", "laboratory", "moving", "runs"]
