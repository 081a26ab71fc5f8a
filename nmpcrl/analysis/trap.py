"""The trap: the robot stands before a closed gap, and learning closes it further.

Standing, the robot pays the stage cost l at every step, for ever l / (1 - gamma). The plan, which
hopes to arrive or to stop paying for the gap, is worth less. So delta = l + gamma V - V is above 0,
and a step along phi makes V larger: theta_c grows, since V does with it. The value gets more
accurate while the policy gets worse.
"""

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from itertools import dropwhile, takewhile

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.learning.rollout import Persistent, evaluate
from nmpcrl.study import paper
from nmpcrl.study.geometry import Centres
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.setup import controller_of

STOOD = 10  # steps at the end of a rollout in which it is seen whether the robot stands
PART = 20  # episodes at either end of training over which delta is compared
RISE = 0.2  # share of the cost by which it rises at a cliff, from one theta_c of a grid to the next
CLOSE = 1e-3  # of theta_c, to which a cliff is found


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


@dataclass(frozen=True, eq=False)
class Stand:
    """Where the rollout of a theta ends without noise, and what the plan says of that place."""

    episode: int  # after which theta was this
    theta_c: float
    delta: float  # root mean square over that episode; nan before the first
    states: Matrix
    cost: float  # of the rollout
    arrived: bool
    moved: float  # way [m] in its last `STOOD` steps
    stage_cost: float  # l, in its last step
    value: float  # V there
    phi_c: float  # and its slope in theta_c

    @property
    def forever(self) -> float:
        """What standing there for ever costs, l / (1 - gamma)."""
        return self.stage_cost / (1 - paper.GAMMA)


def stands(summary: RunSummary, episodes: Iterable[int]) -> list[Stand]:
    """The rollouts of a run's theta after some of its episodes, the 0th being the start."""
    experiment = summary.name
    controller: Persistent = controller_of(experiment)
    thetas = np.vstack([experiment.theta, summary.episodes["theta"]])
    deltas = np.r_[np.nan, summary.episodes["delta"]]
    return [stand(controller, thetas[k], experiment.steps, k, deltas[k]) for k in episodes]


def stand(
    controller: Persistent, theta: Vector, steps: int, episode: int = 0, delta: float = np.nan
) -> Stand:
    """The rollout of one theta; episode and delta are noted."""
    rollout = evaluate(controller, theta, steps)
    states, task = rollout.states, controller.nmpc.task
    there = controller.solve(states[-1], theta)
    away = task.distance(states[-1]) > ARRIVED
    numbers = (_way(states), float(rollout.costs[-1]), there.value, float(there.features[-1]))
    return Stand(episode, theta[-1], delta, states, rollout.cost, not away, *numbers)


def stretch(found: Iterable[Stand], standing: float) -> list[Stand]:
    """The first unbroken part of some stands in which the robot is away and moves less [m]."""
    stands_there = dropwhile(lambda one: one.arrived or one.moved >= standing, found)
    return [*takewhile(lambda one: not one.arrived and one.moved < standing, stands_there)]


def cliff(cost: Callable[[float], float], grid: Vector, costs: Vector) -> float:
    """The largest theta_c before the cost rises by `RISE` at once; nan where it never does.

    Args:
        cost: of a rollout with a theta_c.
        grid: of theta_c, ascending.
        costs: on the grid.
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
    """By which share of its cost a rollout costs more with theta_c raised by another share."""
    controller = Persistent(paper.nmpc(layout))
    raised = np.array([*theta[:-1], (1 + share) * theta[-1]])
    before, after = (evaluate(controller, one, paper.STEPS).cost for one in (theta, raised))
    return after / before - 1


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
    worth = solution.value * (1 - controller.gamma) / cost
    return _way(summary.states), worth, float(solution.features[-1])


def _way(states: Matrix) -> float:
    return float(np.linalg.norm(np.diff(states[-STOOD - 1 :, :2], axis=0), axis=1).sum())


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else np.nan
