"""A step of GES taken apart: how it differs from a step of ES."""

from dataclasses import dataclass

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.analysis import metrics
from nmpcrl.study import paper
from nmpcrl.study.records import Records


@dataclass(frozen=True, eq=False)
class Directions:
    """What moves theta in each step of a run of GES."""

    episode: Vector  # of each step, shape (steps,)
    semi_gradient: Matrix  # delta phi, shape (steps, d)
    correction: Matrix  # gamma (w'phi) phi+, shape (steps, d)
    delta: Vector  # TD errors
    predicted: Vector  # w'phi, what w expects delta to be

    @property
    def lengths(self) -> tuple[Vector, Vector]:
        """Norms of the semi-gradients and of the corrections."""
        return _norm(self.semi_gradient), _norm(self.correction)

    @property
    def share(self) -> float:
        """Summed length of the corrections over that of the semi-gradients."""
        semi_gradient, correction = self.lengths
        return float(correction.sum() / semi_gradient.sum())

    @property
    def net(self) -> float:
        """How far theta got, over how far the semi-gradients that it met add up to."""
        went = (self.semi_gradient - self.correction).sum(axis=0)
        return float(np.linalg.norm(went) / np.linalg.norm(self.semi_gradient.sum(axis=0)))


def directions(records: Records) -> Directions:
    """Take the steps of a run of GES apart: the correction is what theta did not do of delta phi.

    Eq. (16) gives gamma (w'phi) phi+ = delta phi - (theta' - theta) / alpha, without a solve.
    """
    steps, alpha = records.steps, records.experiment["alpha"]
    known = np.isfinite(steps["delta"])
    before = np.vstack([np.full(steps["w"].shape[1], paper.W_INIT), steps["w"][:-1]])
    along = steps["delta"][:, None] * steps["features"]
    correction = along - (steps["theta"] - metrics.theta_before(records)) / alpha
    predicted = np.sum(before * steps["features"], axis=1)
    columns = (steps["episode"], along, correction, steps["delta"], predicted)
    return Directions(*(column[known] for column in columns))


def _norm(vectors: Matrix) -> Vector:
    return np.linalg.norm(vectors, axis=1)
