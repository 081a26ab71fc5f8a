"""How a solve starts and how it ends, as numbers: `kernel` is compiled beside a copy of this."""

from enum import IntEnum


class Start(IntEnum):
    """What a solve starts from."""

    COLD = 0  #: inputs alone
    SHIFTED = 1  #: an earlier solution, a stage later
    NEAR = 2  #: an earlier solution as it is
    SAME = 3  #: one in the same state, where only theta has moved
    HELD = 4  #: inputs that feedback finds and holds, where every stage stands at s before


class End(IntEnum):
    """Why the iterations ended."""

    SOLVED = 0
    STALLED = 1  #: no step descends
    LIMIT = 2  #: too many iterations
    BROKEN = 3  #: numbers that are not finite
    SADDLE = 4  #: a stationary plan from which one curves down to less, a maximum, or a saddle
