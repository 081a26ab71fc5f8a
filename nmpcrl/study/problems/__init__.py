"""Problems of other authors, and problems with a known truth: each a plan, a plant and a start."""

from nmpcrl.study.problems import gros_zanon, lqr

__all__ = ["gros_zanon", "lqr"]
