"""The two parts of a step of GES: the semi-gradient of ES, and the correction."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from nmpcrl import Matrix, Vector
from nmpcrl.analysis import metrics
from nmpcrl.control import SolverError
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Records
from nmpcrl.study.setup import controller_of


@dataclass(frozen=True, eq=False)
class Directions:
    """The two parts of each step of a run of GES."""

    episode: Vector  # of each step, shape (steps,)
    semi_gradient: Matrix  # delta phi, shape (steps, d)
    correction: Matrix  # gamma (w'phi) phi+, shape (steps, d)
    delta: Vector  # TD errors
    predicted: Vector  # w'phi, the prediction of delta

    @property
    def lengths(self) -> Matrix:
        """Norms of the semi-gradients and of the corrections, shape (2, steps)."""
        found: Matrix = np.linalg.norm([self.semi_gradient, self.correction], axis=2)
        return found

    @property
    def share(self) -> float:
        """Summed length of the corrections over the summed length of the semi-gradients."""
        semi_gradient, correction = self.lengths.sum(axis=1)
        return float(correction / semi_gradient)

    @property
    def net(self) -> float:
        """Distance that theta moved over the length of the summed semi-gradients."""
        went = (self.semi_gradient - self.correction).sum(axis=0)
        return float(np.linalg.norm(went) / np.linalg.norm(self.semi_gradient.sum(axis=0)))


def directions(records: Records) -> Directions:
    """The parts of the steps of a run of GES, without a solve.

    Eq. (16) gives gamma (w'phi) phi+ = delta phi - (theta' - theta) / alpha.
    """
    steps, alpha = records.steps, records.experiment["alpha"]
    known = np.isfinite(steps["delta"])
    before = np.vstack([np.full(steps["w"].shape[1], paper.W_INIT), steps["w"][:-1]])
    along = steps["delta"][:, None] * steps["features"]
    correction = along - (steps["theta"] - metrics.theta_before(records)) / alpha
    predicted = np.sum(before * steps["features"], axis=1)
    columns = (steps["episode"], along, correction, steps["delta"], predicted)
    return Directions(*(column[known] for column in columns))


def dropped_curvature(records: Records, *, samples: int = 200) -> pd.DataFrame:
    """The dropped term h of a run of GES, at steps spread evenly over training, one row each.

    Columns episode, direction (||delta phi - gamma (w'phi) phi+||), dropped (||h||) and ratio, of
    the dropped term to the printed direction.
    """
    steps, gamma = records.steps, paper.GAMMA
    nmpc = controller_of(Experiment(**records.experiment))
    known = np.flatnonzero(np.isfinite(steps["delta"]))[1:]
    rows = []
    for k in known[np.linspace(0, len(known) - 1, min(samples, len(known)), dtype=int)]:
        theta, w = steps["theta"][k - 1], steps["w"][k - 1]
        state, action, delta = steps["state"][k], steps["action"][k], steps["delta"][k]
        try:
            solution = nmpc.solve(state, theta)
            after = nmpc.solve(nmpc.plant.step(state, action), theta, solution)
            hessian = nmpc.value_hessian(solution)
        except SolverError:
            continue
        phi = solution.features
        direction = delta * phi - gamma * (w @ phi) * after.features
        dropped = (delta - phi @ w) * hessian @ w
        rows.append((steps["episode"][k], np.linalg.norm(direction), np.linalg.norm(dropped)))
    found = pd.DataFrame(rows, columns=["episode", "direction", "dropped"])
    return found.assign(ratio=found.dropped / found.direction)
