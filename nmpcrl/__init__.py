"""Reinforcement learning on top of nonlinear model predictive control: one paper, reproduced.

Three layers, imported one way: `study` (what is measured) -> `learning` (how the parameters move)
-> `control` (what the controller is).
"""

import numpy as np
from numpy.typing import NDArray

__version__ = "0.1.0"

Vector = NDArray[np.float64]  # one dimension; the docstring of each function gives its length
Matrix = NDArray[np.float64]  # two dimensions
