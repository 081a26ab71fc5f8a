"""How long a step takes, and how long it takes others: measured, kept, and held against targets."""

from nmpcrl.bench.suite import LENGTHS, STEPS, beforehand, read_or_measure

__all__ = ["LENGTHS", "STEPS", "beforehand", "read_or_measure"]
