"""What `rows_entries` needs to know of a `Problem` beyond its expressions.

These are the names: `codegen.browser` generates a module of them, as `stages` does for `model`.
"""

import numpy as np

N, ROWS = 0, 0  # horizon, and rows of a stage
WARM_LIMIT, COLD_LIMIT = 0, 0  # iterations, as `riccati` has them
FACTOR, TIE = 1.0, 0.0
LOWER = UPPER = np.zeros(0)  # of the inputs, in parts of INPUTS
STATES = INPUTS = SIZES = np.zeros(0)  # units of states, of inputs, and of z, lam and nu, twice
DISCOUNT = np.zeros(0)  # (N + 1,)
WEIGHTS = np.zeros(0)  # (ROWS,)
KIND = np.zeros((2, 0, 0), np.int64)  # with u_0 free and given, each (N + 1, ROWS)
DATA = np.zeros((0, 0))  # where none are given, (N + 1, size)
THETA = THETA_LOWER = THETA_UPPER = np.zeros(0)
RANDOM_INPUTS = np.zeros((0, 0, 0))  # of the last starts, (starts, N, inputs)
