"""What `entries` needs to know of a task, beyond what `model` says of its plant.

`codegen.browser` generates a module of the same name, as `stages` does for `model`.
"""

from typing import Any

import numpy as np

DISCS = 16  # obstacles at most
LONGEST = 40  # horizon at most
WARM_LIMIT, COLD_LIMIT = 0, 0  # iterations, as `riccati` has them
RANDOM_INPUTS = np.zeros((0, 0, 0))  # of the last starts, (starts, LONGEST, inputs)


def charge(state: Any, action: Any, target: Any, discs: Any) -> float:
    """The RL stage cost, Eq. (20), with discs of shape (DISCS, 3)."""
    raise NotImplementedError
