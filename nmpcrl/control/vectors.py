"""Vectors that a description keeps for itself."""

from typing import Any

import numpy as np

from nmpcrl import Vector


def kept(numbers: Any) -> Vector:
    """A copy that nobody can change, whatever becomes of the array that it was made of."""
    copy = np.array(numbers, float)
    copy.setflags(write=False)
    return copy
