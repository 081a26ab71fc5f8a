"""A step of GES taken apart: how it differs from a step of ES."""

from dataclasses import dataclass

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.analysis import metrics
from nmpcrl.control import SolverError
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Records
from nmpcrl.study.setup import controller_of


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
    result: Vector = np.linalg.norm(vectors, axis=1)
    return result


@dataclass(frozen=True, eq=False)
class Curvature:
    """Sizes of the printed direction and of the dropped term at sampled steps of one run."""

    episode: Vector
    direction: Vector  # ||delta phi - gamma (w'phi) phi+||
    dropped: Vector  # ||h||

    @property
    def ratio(self) -> Vector:
        """How large the dropped term is beside what is printed."""
        return self.dropped / self.direction


def dropped_curvature(records: Records, *, samples: int = 200) -> Curvature:
    """Evaluate h along a run of GES, at steps spread evenly over training.

    Args:
        records: a run of GES.
        samples: how many steps to look at; those at which the Hessian does not exist are left out.
    """
    steps, gamma = records.steps, paper.GAMMA
    nmpc = controller_of(Experiment(**records.experiment)).nmpc
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
    episode, direction, dropped = np.array(rows).T
    return Curvature(episode, direction, dropped)
