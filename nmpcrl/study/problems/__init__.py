"""Problems that others have posed, and such whose truth is known: each a plan, a plant and a start.

They are read by `Nmpc`, `train` and `evaluate` as a user's own are.
"""

from nmpcrl.study.problems import grid, gros_zanon, lqr

__all__ = ["grid", "gros_zanon", "lqr"]
