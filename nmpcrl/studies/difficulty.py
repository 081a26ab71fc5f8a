"""Measures of a layout before training, and how well each predicts where learning succeeds.

The first five are the measures by which BARN orders its maps (Perille et al. 2020, "Benchmarking
Metric Ground Navigation"). BARN counts cells of a grid along its shortest path, and averages over
the path. Here

- obstacles are discs and walls are lines, so that distances are exact and not numbers of cells; a
  disc is as wide as plans at theta_c = 0 keep;
- the path is the first trajectory of the controller, without noise, from theta_init, up to where
  the robot has arrived; its points are `SPACING` apart;
- a point within a disc is at distance 0 from it and has no view.

A predictor is a logistic regression of one measure, fitted on some layouts and scored on others: by
the area under the ROC curve and by the Brier score. The bootstrap draws layouts.
"""

from typing import Any

import numpy as np
import pandas as pd
from scipy import optimize, stats

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.statistics import over_layouts
from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.control import Task
from nmpcrl.learning.rollout import evaluate
from nmpcrl.studies.investigation import Investigation, Part, Row
from nmpcrl.study import paper
from nmpcrl.study.drawn import COMPARED, LAYOUTS
from nmpcrl.study.geometry import Centres
from nmpcrl.study.layouts import ARRIVED

SPACING = 0.15  # [m]; the side of a cell of BARN
REACH = 3 * SPACING  # [m]; how far BARN's dispersion looks
SIGHTS = 8  # directions in which visibility looks
SECTORS = 16  # directions in which dispersion looks
RAISED = 0.01  # of theta_c, for the slope of the cost
OPEN = 1.0  # theta_c beyond which it does not matter where a gap closes
HORIZONS = (20, 40)  # beside the paper's
SAME_CLOSING = 0.05  # of theta_c: the step of the grid on which two horizons close the same gap
GRID = np.arange(0, 0.5 + 1e-9, SAME_CLOSING)
STOPS = {n: f"stops_{n}" for n in (paper.HORIZON, *HORIZONS)}  # columns by horizon

MEASURES = (  # a higher one means easier, or harder where a comment says so
    "closest",  # mean distance [m] to the closest obstacle or wall
    "visibility",  # mean distance [m] to the first disc or wall in `SIGHTS` directions
    "dispersion",  # changes between blocked and free around a point; the higher, the harder
    "dimension",  # mean of the least width [m] across a point, along 4 lines
    "tortuosity",  # length of the path over its chord's; the higher, the harder
    "cost",  # without noise, of theta_init; the higher, the harder
    "slope",  # of the cost in theta_c; the higher, the harder
    "overshoot",  # alpha ||phi||^2 in the start; the higher, the harder
    "closes",  # theta_c at which the first gap of the path closes, at most `OPEN`
)
PILOT = "closes"  # predicted every failure of the pilot
RIVALS = tuple(name for name in MEASURES if name != PILOT)
RIDGE = 1.0  # penalty of the logistic regression, of the squared slope of the standardised measure


def measure(centres: Centres) -> dict[str, float]:
    """`MEASURES` of a layout, from two rollouts and one solve."""
    task = paper.task(centres)
    controller, theta = paper.controller(task), np.array(paper.THETA_INIT)
    first = evaluate(controller, theta, paper.STEPS)
    raised = evaluate(controller, theta + RAISED * np.eye(len(theta))[-1], paper.STEPS)
    phi = controller.solve(task.start, theta).features
    there = np.flatnonzero(np.linalg.norm(first.states - task.target, axis=1) <= ARRIVED)
    path = first.states[: there[0] + 1 if there.size else None, :2]
    return barn(path, task) | {
        "cost": first.cost,
        "slope": (raised.cost - first.cost) / RAISED,
        "overshoot": float(paper.ALPHA * phi @ phi),
        "closes": min(closes_at(task, path), OPEN),
    }


def barn(path: Matrix, task: Task) -> dict[str, float]:
    """The five measures of BARN along a path, shape (points, 2)."""
    points = spaced(path)
    across = sight(points, SIGHTS, task)
    blocked = sight(points, SECTORS, task) <= REACH
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    return {
        "closest": float(clearance(points, task).mean()),
        "visibility": float(across.mean()),
        "dispersion": float((blocked != np.roll(blocked, 1, axis=1)).sum(axis=1).mean()),
        "dimension": float((across[:, : SIGHTS // 2] + across[:, SIGHTS // 2 :]).min(1).mean()),
        "tortuosity": float(length / np.linalg.norm(path[-1] - path[0])),
    }


def stops_arriving(centres: Centres, horizon: int, grid: Vector) -> float:
    """The least theta_c of a grid at which the robot does not arrive, all else as theta_init.

    nan where it arrives on the whole grid.
    """
    task = paper.task(centres)
    controller, theta = paper.controller(task, horizon=horizon), [*paper.THETA_INIT]
    for theta_c in grid:
        states = evaluate(controller, np.array([*theta[:-1], theta_c]), paper.STEPS).states
        if len(states) < paper.STEPS or task.distance(states[-1]) > ARRIVED:
            return float(theta_c)
    return np.nan


def spaced(path: Matrix) -> Matrix:
    """Points of a path that lie `SPACING` apart along it, from its first on."""
    along = np.r_[0.0, np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()]
    wanted = np.arange(0.0, along[-1] + 1e-9, SPACING)
    return np.stack([np.interp(wanted, along, column) for column in path.T], axis=1)


def clearance(points: Matrix, task: Task) -> Vector:
    """Distance [m] of each point, shape (k, 2), to the closest disc or wall; 0 within a disc."""
    centres, radius = _discs(task)
    away = np.linalg.norm(points[:, None] - centres, axis=-1) - radius
    walls = np.concatenate([points - task.lower[:2], task.upper[:2] - points], axis=1)
    result: Vector = np.concatenate([away, walls], axis=1).min(axis=1).clip(min=0)
    return result


def sight(points: Matrix, directions: int, task: Task) -> Matrix:
    """Distance [m] from points, shape (k, 2), to the first disc or wall in directions around."""
    angle = np.arange(directions) * 2 * np.pi / directions
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    centres, radius = _discs(task)
    to = centres - points[:, None]  # (k, discs, 2)
    away, along = (to**2).sum(-1)[:, None], np.einsum("kdi,ri->krd", to, ray)
    inside = radius**2 - away + along**2
    hit = along - np.sqrt(inside.clip(min=0))
    discs = np.where((inside >= 0) & (hit >= 0), hit, np.inf)
    discs = np.where(away <= radius**2, 0.0, discs).min(axis=-1, initial=np.inf)
    limit = np.where(ray > 0, task.upper[:2], task.lower[:2])  # the walls ahead, (directions, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (limit - points[:, None]) / ray
    walls = np.where(np.abs(ray) > 1e-12, far, np.inf).min(axis=-1).clip(min=0)
    result: Matrix = np.minimum(discs, walls)
    return result


def _discs(task: Task) -> tuple[Matrix, float]:
    """Centres of the discs, shape (discs, 2), and their radius [m] at theta_c = 0."""
    x, y, clearance = task.discs
    return np.stack([x, y], axis=1), float(clearance.max() / 2)


def of_layout(_: str, place: str, *unused: int) -> Row:
    """The row of a layout; theta_c at which rollouts stop arriving only in compared layouts."""
    centres, known = LAYOUTS[place], place in COMPARED
    return measure(centres) | {
        column: stops_arriving(centres, horizon, GRID) if known else np.nan
        for horizon, column in STOPS.items()
    }


def predicted(measure: Vector, success: Vector, asked: Vector) -> tuple[float, Vector]:
    """The slope of a logistic regression, and P(success) = 1 / (1 + exp(-(intercept + slope z))).

    It is fitted to `measure` and `success`, one a layout; the probabilities are those where the
    measure is `asked`. z is the measure, standardised. `RIDGE` times half of the squared slope is
    added to the log loss: the slope stays finite where a measure separates the two outcomes.
    """
    x, sign = np.asarray(measure, float), np.where(success, 1.0, -1.0)
    if not np.isfinite(x).all():
        raise ValueError(f"{(~np.isfinite(x)).sum()} of {x.size} measures are not finite")
    centre, scale = x.mean(), x.std() or 1.0
    z = (x - centre) / scale

    def loss(b: Vector) -> float:
        return float(np.logaddexp(0, -sign * (b[0] + b[1] * z)).sum() + RIDGE * b[1] ** 2 / 2)

    share = ((sign > 0).sum() + 0.5) / (x.size + 1)  # finite where all succeed, too
    start = np.array([np.log(share / (1 - share)), 0.0])
    intercept, slope = optimize.minimize(loss, start, method="BFGS").x
    return float(slope), 1 / (1 + np.exp(-(intercept + slope * (asked - centre) / scale)))


def auc(score: Vector, success: Vector) -> Any:
    """Probability that a success scores above a failure, over the last axis; a tie counts one half.

    nan where all layouts succeed, or none.
    """
    y = np.asarray(success, bool)
    won, lost = y.sum(axis=-1), (~y).sum(axis=-1)
    ranks = np.where(y, stats.rankdata(score, axis=-1), 0).sum(axis=-1)
    with np.errstate(invalid="ignore"):  # 0 / 0
        return (ranks - won * (won + 1) / 2) / (won * lost)


def brier(probability: Vector, success: Vector) -> Any:
    """Mean squared difference of probability and outcome, over the last axis: 0 is perfect."""
    return np.mean((np.asarray(probability) - np.asarray(success, float)) ** 2, axis=-1)


def predictor_scores(difficulty: pd.DataFrame, tuned: pd.Series, judged: pd.Series) -> pd.DataFrame:
    """Each measure as a predictor of success, fitted on layouts `tuned` and scored on `judged`.

    `difficulty` has the columns `MEASURES` and a row a layout. A row a measure: slope (of the
    standardised measure), auc and brier, each an `Estimate`, and ahead, by how much the area of
    `PILOT` is larger (an `Estimate`; 0 for itself).
    """
    known, asked, y = difficulty.loc[tuned.index], difficulty.loc[judged.index], judged.to_numpy()
    found = {
        name: predicted(known[name].to_numpy(), tuned.to_numpy(), asked[name].to_numpy())
        for name in MEASURES
    }
    rows = {
        name: {
            "slope": slope,
            "auc": over_layouts(auc, p, y),
            "brier": over_layouts(brier, p, y),
            "ahead": over_layouts(
                lambda pilot, p, y: auc(pilot, y) - auc(p, y), found[PILOT][1], p, y
            ),
        }
        for name, (slope, p) in found.items()
    }
    return pd.DataFrame.from_dict(rows, orient="index")


DIFFICULTY = Investigation(
    name="population_layouts",
    parts={"before training": Part(of_layout, {"theta_init": ""}, tuple(LAYOUTS), 1, seconds=2)},
    questions=(),  # the questions of `population` read the table
    seed=lambda place, k: k,  # no row draws
    registered="46c248b",
    digits=9,
)
