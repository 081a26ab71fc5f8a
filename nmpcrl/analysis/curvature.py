"""The term that Eq. (16) drops from nonlinear TDC, and how large it would be.

Maei et al. (2009) subtract h = (delta - phi'w) (Hessian of Q) w from the direction of theta.
# departure K
"""

from dataclasses import dataclass

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import SolverError
from nmpcrl.study import paper
from nmpcrl.study.records import Records


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
    nmpc = paper.nmpc(records.experiment["layout"], horizon=records.experiment["horizon"])
    known = np.flatnonzero(np.isfinite(steps["delta"]))[1:]
    rows = []
    for k in known[np.linspace(0, len(known) - 1, min(samples, len(known)), dtype=int)]:
        theta, w = steps["theta"][k - 1], steps["w"][k - 1]
        state, action, delta = steps["state"][k], steps["action"][k], steps["delta"][k]
        try:
            solution = nmpc.solve(state, theta)
            after = nmpc.solve(nmpc.plant.step(state, action), theta, solution)
            hessian = nmpc.value_hessian(solution)
        except (SolverError, np.linalg.LinAlgError):
            continue
        phi = solution.features
        direction = delta * phi - gamma * (w @ phi) * after.features
        dropped = (delta - phi @ w) * hessian @ w
        rows.append((steps["episode"][k], np.linalg.norm(direction), np.linalg.norm(dropped)))
    episode, direction, dropped = np.array(rows).T
    return Curvature(episode, direction, dropped)
