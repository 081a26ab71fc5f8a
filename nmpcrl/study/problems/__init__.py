"""Problems of other authors, and with known solutions: each has a plan, a plant and a start."""

from nmpcrl.study.problems import gros_zanon, lqr

__all__ = ["gros_zanon", "lqr"]
