"""Searches for theta by the costs of rollouts without noise.

A direct search calls `cost` at most `budget` times, first with the start, and returns the theta of
least cost. `search` is one long CMA-ES in a layout: a lower bound of the possible gain.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import paper

SCALE: Vector = np.array([1, 1, 0.1, 0.1, 0.1, 1, 1, 0.1, 0.3])  # of each component of theta
LOWER, UPPER = np.r_[np.zeros(8), -0.5], np.r_[np.full(8, 10.0), 1.0]  # bounds of theta
FAILED = 1e6  # cost of a rollout in which a solve failed
POINTS = 11  # of the grid
WIDEST = 0.35  # last theta_c of the grid: d_o, where the penalty vanishes  # departure N
DECAY, FADING = 0.602, 0.101  # SPSA: exponents of the step and of the perturbation
SPREAD = 0.3  # CMA-ES: of the first rollouts, in `SCALE`s
BUDGET = 2000  # rollouts of a published long search
Cost = Callable[[Vector], float]  # theta -> cost of a rollout; infinite where a solve failed


class Rollouts:
    """The rollouts of a search, at most `budget`, at points in units of `SCALE`."""

    lower, upper = LOWER / SCALE, UPPER / SCALE

    def __init__(self, cost: Cost, start: Vector, budget: int) -> None:
        """Make the first rollout."""
        if budget < 1:
            raise ValueError(f"budget = {budget} must be at least 1 rollout")
        self._cost, self._budget = cost, budget
        self.points: list[Vector] = []
        self.costs: list[float] = []
        self(np.asarray(start, float) / SCALE)

    def __call__(self, point: Vector) -> float:
        """The cost of a rollout; `FAILED` if a solve failed."""
        assert self.left, "the search goes beyond its budget"
        self.points.append(point)
        self.costs.append(self._cost(point * SCALE))
        return min(self.costs[-1], FAILED)

    @property
    def left(self) -> int:
        """Rollouts left of the budget."""
        return self._budget - len(self.costs)

    @property
    def best(self) -> Vector:
        """The first point of least cost."""
        return self.points[int(np.argmin(self.costs))]

    @property
    def theta(self) -> Vector:
        """The best point as theta."""
        return self.best * SCALE

    def descend(self, spread: float, seed: int, *, least: int = 1) -> None:
        """CMA-ES from the best point until it has converged; Hansen (2016).

        A generation begins with at least so many rollouts left; 0 stands for a complete one.
        """
        import cma  # takes a second

        options = {"bounds": [self.lower, self.upper], "seed": seed, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(self.best, spread, options)
        while self.left >= (least or strategy.popsize) and not strategy.stop():
            asked = strategy.ask()
            costs = [self(one) for one in asked[: self.left]]
            if len(costs) == len(asked):
                strategy.tell(asked, costs)


def grid(cost: Cost, start: Vector, budget: int, seed: int = 0) -> Vector:
    """Theta with the best theta_c of `POINTS`, the start's and equidistant ones up to `WIDEST`."""
    tried = Rollouts(cost, start, budget)
    for theta_c in np.linspace(start[-1], WIDEST, POINTS)[1:][: tried.left]:
        tried(np.r_[start[:-1], theta_c] / SCALE)
    return tried.theta


def spsa(
    cost: Cost, start: Vector, budget: int, seed: int = 0, *,
    step: float = 0.1, perturbed: float = 0.05,
) -> Vector:  # fmt: skip
    """Simultaneous perturbation: two rollouts an iteration, `perturbed` on either side of theta.

    g = (y+ - y-) / (2 c_k) sign, theta <- theta - a_k g, with a_k = a / (k + 1 + A)^0.602 and
    c_k = perturbed / (k + 1)^0.101; the first step is `step` long in each component, and no later
    one is longer. The last rollout of an even budget judges the last theta. Source: Spall (1998).
    """
    tried, rng = Rollouts(cost, start, budget), np.random.default_rng(seed)
    point, delay, a, k = np.asarray(start, float) / SCALE, budget / 20, 0.0, 0
    while tried.left >= 2:
        signs = rng.choice([-1.0, 1.0], point.size)
        c = perturbed / (k + 1) ** FADING
        up, down = (
            tried(np.clip(point + side * c * signs, tried.lower, tried.upper)) for side in (1, -1)
        )
        slope = (up - down) / (2 * c)
        a = a or (step * (1 + delay) ** DECAY / abs(slope) if slope else 0.0)
        length = np.clip(a / (k + 1 + delay) ** DECAY * slope, -step, step)
        point, k = np.clip(point - length * signs, tried.lower, tried.upper), k + 1
    if tried.left:
        tried(point)
    return tried.theta


def cma_es(
    cost: Cost, start: Vector, budget: int, seed: int = 0, *, spread: float = SPREAD
) -> Vector:
    """CMA-ES, restarted from the best point after convergence; the last generation may be cut."""
    tried, again = Rollouts(cost, start, budget), 0
    while tried.left:
        tried.descend(spread, 1 + (seed + 7919 * again) % (2**31 - 2))  # 0 would mean the clock
        again += 1
    return tried.theta


def bayesian(
    cost: Cost, start: Vector, budget: int, seed: int = 0, *, nearby: float = 1.0
) -> Vector:
    """Bayesian optimisation by tree-structured Parzen estimators; Bergstra et al. (2011).

    Thetas are drawn within `nearby` of the start: few thetas of the full box bring the robot to
    its target. Needs Optuna, of the extra `nmpcrl[search]`.
    """
    import optuna

    tried = Rollouts(cost, start, budget)
    first = {f"{k}: {name}": one for k, (name, one) in
             enumerate(zip(paper.THETA_NAMES, tried.best.tolist(), strict=True))}  # fmt: skip
    lower = np.maximum(tried.lower, tried.best - nearby)
    upper = np.minimum(tried.upper, tried.best + nearby)
    box: dict[str, Any] = {
        name: optuna.distributions.FloatDistribution(*ends)
        for name, *ends in zip(first, lower, upper, strict=True)
    }
    shown = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)  # a line a rollout, else
    try:
        study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed))
        value = min(tried.costs[0], FAILED)
        study.add_trial(optuna.trial.create_trial(params=first, distributions=box, value=value))
        while tried.left:
            trial = study.ask(box)
            study.tell(trial, tried(np.array([trial.params[name] for name in first])))
    finally:
        optuna.logging.set_verbosity(shown)
    return tried.theta


SEARCHES: dict[str, Callable[..., Vector]] = {  # (cost, start, budget, seed, settings) -> theta
    "grid": grid, "SPSA": spsa, "CMA-ES": cma_es, "Bayes": bayesian,
}  # fmt: skip


@dataclass(frozen=True)
class SearchResult:
    """The result of a search and each improvement; the first rollout is under theta_init."""

    theta: tuple[float, ...]
    made: int  # rollouts in all
    rollouts: tuple[int, ...]  # number of the rollout of each improvement, from 1 on
    best: tuple[float, ...]  # lowest cost from there on

    @property
    def initial(self) -> float:
        """Noise-free cost of theta_init."""
        return self.best[0]

    @property
    def cost(self) -> float:
        """Noise-free cost of theta."""
        return self.best[-1]

    @property
    def gain(self) -> float:
        """Share of theta_init's cost that theta saves."""
        return 1 - self.cost / self.initial


def search(layout: str, budget: int = BUDGET, seed: int = 0) -> SearchResult:
    """The theta of least noise-free cost in a layout that one CMA-ES finds from theta_init."""
    controller, start = paper.nmpc(layout), np.array(paper.THETA_INIT)
    tried = Rollouts(lambda theta: evaluate(controller, theta, paper.STEPS).cost, start, budget)
    tried.descend(SPREAD, seed + 1, least=0)
    lowest = np.minimum.accumulate(tried.costs)
    fell = np.flatnonzero(np.r_[True, lowest[1:] < lowest[:-1]])
    return SearchResult(
        theta=tuple((tried.points[fell[-1]] * SCALE).tolist()),
        made=len(tried.costs),
        rollouts=tuple((fell + 1).tolist()),
        best=tuple(lowest[fell].tolist()),
    )
