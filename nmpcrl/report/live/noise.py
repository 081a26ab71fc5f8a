"""numpy's normal noise for other hosts: the widths of its ziggurat, asked of numpy itself."""

from typing import Any

import numpy as np

STRIPS = 256
SMALL = 2**51  # a place within every strip but the second, whose accepts it with the next draw
MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645  # of PCG64
ALL = 1 << 128


def widths() -> list[float]:
    """The ends of the strips in numpy's own digits, divided by 2^52.

    numpy multiplies one of them by 52 random bits: the normal numbers of bits that are chosen.
    """
    return [abs(drawn(strip + (SMALL << 9))) / SMALL for strip in range(STRIPS)]


def drawn(bits: int) -> float:
    """The normal number that numpy makes of 64 bits, and of more if these are not enough."""
    generator, increment = np.random.PCG64(), 1
    before = (bits - increment) * pow(MULTIPLIER, -1, ALL) % ALL  # then the state is `bits`
    state: Any = generator.state
    state["state"] = {"state": before, "inc": increment}
    generator.state = state
    return float(np.random.Generator(generator).standard_normal())
