"""Reinforcement learning on top of nonlinear model predictive control: one paper, reproduced.

Ten packages, imported one way: `commands` (the command `nmpcrl`) -> `report` (what pages show) and
`course` (exercises) -> `studies` (investigations) -> `claims` (verdicts) -> `analysis` (numbers)
and `bench` (times) -> `study` (what is run, and where it is kept) -> `learning` (how the parameters
move) -> `control` (what the controller is).
"""

import numpy as np
from numpy.typing import NDArray

__version__ = "0.1.0"

Vector = NDArray[np.float64]  # one dimension; the docstring of each function gives its length
Matrix = NDArray[np.float64]  # two dimensions
