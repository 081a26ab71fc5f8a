"""The trap: the robot stands before a closed gap, and learning closes it further.

Standing, the robot pays the stage cost l at every step, for ever l / (1 - gamma). The plan, which
hopes to arrive or to stop paying for the gap, is worth less. So delta = l + gamma V - V is above 0,
and a step along phi makes V larger: theta_c grows, since V does with it. The value gets more
accurate while the policy gets worse.
"""

from dataclasses import asdict, dataclass

import numpy as np

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.learning.rollout import Persistent
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.setup import controller_of

STOOD = 10  # steps at the end of a rollout in which it is seen whether the robot stands
PART = 20  # episodes at either end of training over which delta is compared


@dataclass(frozen=True)
class Ending:
    """The end of a run without noise, and what became of the TD error on the way."""

    moved: (
        float  # way [m] in the last `STOOD` steps; nan where the robot arrived, or a solve failed
    )
    worth: float  # V over l / (1 - gamma) there; nan where the robot arrived
    delta_first: float  # root mean square over the first `PART` episodes
    delta_last: float  # and over the last
    phi_c: float  # slope of V in theta_c there; nan where the robot arrived


NOTHING = (np.nan, np.nan, np.nan)


def ending(summary: RunSummary) -> Ending:
    """What a summary tells of the trap."""
    moved, worth, phi_c = _standing(summary) if _is_away(summary) else NOTHING
    delta = summary.episodes["delta"]
    reached = delta[np.isfinite(delta)]
    return Ending(moved, worth, _rms(reached[:PART]), _rms(reached[-PART:]), phi_c)


def as_row(summary: RunSummary) -> dict[str, float]:
    """`ending`, by name."""
    return asdict(ending(summary))


def _is_away(summary: RunSummary) -> bool:
    """Whether the last rollout went to its end without arriving."""
    whole = bool(np.isfinite(summary.states).all())
    return whole and bool(summary.evaluations["distance"][-1] > ARRIVED)


def _standing(summary: RunSummary) -> tuple[float, float, float]:
    """Way, worth and slope at the end of the last rollout."""
    experiment, state, theta = summary.name, summary.states[-1], summary.evaluations["theta"][-1]
    controller: Persistent = controller_of(experiment)
    solution = controller.solve(state, theta)
    cost = controller.nmpc.task.stage_cost(state, summary.actions[-1])
    steps = np.diff(summary.states[-STOOD - 1 :, :2], axis=0)
    moved = float(np.linalg.norm(steps, axis=1).sum())
    return moved, solution.value * (1 - controller.gamma) / cost, float(solution.features[-1])


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else np.nan
