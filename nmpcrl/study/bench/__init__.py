"""How long a step takes, and how long it takes others: measured, kept, and held against targets."""

from nmpcrl.study.bench.measure import LENGTHS, check, fetch

__all__ = ["LENGTHS", "check", "fetch"]
