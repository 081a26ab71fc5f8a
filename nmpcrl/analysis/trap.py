"""The trap: the robot stands before a closed gap, and learning closes the gap further.

A standing robot pays the stage cost l at every step, l / (1 - gamma) in all. Its plan expects to
arrive and costs less: delta = l + gamma V - V is above 0. A step along phi raises V and theta_c.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import dropwhile, takewhile

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.metrics import root_mean_square
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import paper
from nmpcrl.study.geometry import Centres
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.setup import controller_of

STOOD = 10  # last steps of a rollout, over which the robot's way is measured
PART = 20  # first and last episodes of training, over which delta is compared
RISE = 0.2  # relative rise of the cost at a cliff, from one theta_c of a grid to the next
CLOSE = 1e-3  # accuracy in theta_c of a cliff


@dataclass(frozen=True, eq=False)
class Stand:
    """The end of a rollout of theta without noise, and the plan's value there."""

    episode: int  # after which the run had this theta
    theta_c: float
    delta: float  # root mean square over that episode; nan before the first
    states: Matrix
    cost: float  # of the rollout
    arrived: bool
    moved: float  # way [m] in its last `STOOD` steps
    stage_cost: float  # l, in its last step
    value: float  # V there
    phi_c: float  # slope of V in theta_c there

    @property
    def forever(self) -> float:
        """Cost of standing there for ever, l / (1 - gamma)."""
        return self.stage_cost / (1 - paper.GAMMA)


def stands(summary: RunSummary, episodes: Iterable[int]) -> list[Stand]:
    """The rollouts of a run's theta after some of its episodes; 0 is the start."""
    experiment, found = summary.name, []
    controller = controller_of(experiment)
    thetas = np.vstack([experiment.theta, summary.episodes["theta"]])
    deltas = np.r_[np.nan, summary.episodes["delta"]]
    for k in episodes:
        rollout = evaluate(controller, thetas[k], experiment.steps)
        states, plan = rollout.states, controller.solve(rollout.states[-1], thetas[k])
        found.append(
            Stand(
                episode=k,
                theta_c=thetas[k, -1],
                delta=deltas[k],
                states=states,
                cost=rollout.cost,
                arrived=experiment.task.distance(states[-1]) <= ARRIVED,
                moved=_way(states),
                stage_cost=float(rollout.costs[-1]),
                value=plan.value,
                phi_c=float(plan.features[-1]),
            )
        )
    return found


def stretch(found: Iterable[Stand], standing: float) -> list[Stand]:
    """The first consecutive stands away from the target that move less than `standing` [m]."""
    stands_there = dropwhile(lambda one: one.arrived or one.moved >= standing, found)
    return [*takewhile(lambda one: not one.arrived and one.moved < standing, stands_there)]


def cliff(cost: Callable[[float], float], grid: Vector, costs: Vector) -> float:
    """The largest theta_c before the cost rises by `RISE` at once; nan where it never does.

    `cost` is of a rollout with a theta_c, and `costs` are those on the ascending `grid` of theta_c.
    """
    rises = np.flatnonzero(costs[1:] > (1 + RISE) * costs[:-1])
    if not rises.size:
        return np.nan
    low, high = map(float, grid[rises[0] : rises[0] + 2])
    border = (1 + RISE) * costs[rises[0]]
    while high - low > CLOSE:
        middle = (low + high) / 2
        low, high = (low, middle) if cost(middle) > border else (middle, high)
    return low


def raised_cost(layout: str | Centres, theta: Vector, share: float) -> float:
    """Relative rise of a rollout's cost where theta_c is raised by a share."""
    controller = paper.nmpc(layout)
    raised = np.array([*theta[:-1], (1 + share) * theta[-1]])
    before, after = (evaluate(controller, one, paper.STEPS).cost for one in (theta, raised))
    return after / before - 1


def ending(summary: RunSummary) -> dict[str, float]:
    """The end of a run's last rollout without noise, and the TD errors on the way.

    moved (way [m] in the last `STOOD` steps), worth (V over l / (1 - gamma) at the end) and phi_c
    (slope of V in theta_c at the end), which are nan where the robot arrived or a solve failed;
    delta_first and delta_last (root mean square over the first and the last `PART` episodes).
    """
    delta = summary.episodes["delta"]
    reached = delta[np.isfinite(delta)]
    first, last = (
        root_mean_square(part) if part.size else np.nan
        for part in (reached[:PART], reached[-PART:])
    )
    moved = worth = phi_c = np.nan
    if np.isfinite(summary.states).all() and summary.evaluations["distance"][-1] > ARRIVED:
        state, controller = summary.states[-1], controller_of(summary.name)
        solution = controller.solve(state, summary.evaluations["theta"][-1])
        cost = controller.task.stage_cost(state, summary.actions[-1])
        moved, phi_c = _way(summary.states), float(solution.features[-1])
        worth = solution.value * (1 - controller.gamma) / cost
    return {"moved": moved, "worth": worth, "delta_first": first, "delta_last": last,
            "phi_c": phi_c}  # fmt: skip


def _way(states: Matrix) -> float:
    return float(np.linalg.norm(np.diff(states[-STOOD - 1 :, :2], axis=0), axis=1).sum())
