"""Searches that use nothing but the costs of rollouts: what a tuner would try before learning.

Each calls `cost`, the summed cost of a rollout without noise, at most as often as its budget says,
and every call counts; the first is the start's. It returns the theta whose rollout cost least. The
same seed finds the same theta. `policy_search` is one long CMA-ES a layout, the yardstick.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis.policy_search import FAILED, LOWER, SCALE, SPREAD, UPPER
from nmpcrl.study import paper

Cost = Callable[[Vector], float]  # theta -> cost of a rollout; infinite where a solve failed
Search = Callable[..., Vector]  # (cost, start, budget, seed, further settings by name) -> theta

POINTS = 11  # of the grid
WIDEST = 0.35  # theta_c at which the grid ends: d_o, where the penalty vanishes  # departure N
STEP = 0.1  # SPSA: of each component in the first iteration, and the most later, in `SCALE`s
PERTURBED = 0.05  # SPSA: how far the two rollouts of an iteration lie from theta
NEARBY = 1.0  # Bayes: how far from the start theta is looked for, in `SCALE`s
DECAY, FADING = 0.602, 0.101  # SPSA: exponents of the step and of the perturbation


class Tried:
    """The rollouts of a search, in units of `SCALE`, of which there are at most `budget`."""

    def __init__(self, cost: Cost, start: Vector, budget: int) -> None:
        """Make the first rollout.

        Raises:
            ValueError: the budget has no room for it.
        """
        if budget < 1:
            raise ValueError(f"budget = {budget} must be at least 1 rollout")
        self._cost, self._budget = cost, budget
        self.points: list[Vector] = []
        self.costs: list[float] = []
        self.lower, self.upper = LOWER / SCALE, UPPER / SCALE
        self(np.asarray(start, float) / SCALE)

    def __call__(self, point: Vector) -> float:
        """The cost of a rollout; a large number where it failed."""
        assert self.left, "the search goes beyond its budget"
        self.points.append(point)
        self.costs.append(min(self._cost(point * SCALE), FAILED))
        return self.costs[-1]

    @property
    def left(self) -> int:
        """Rollouts that may still be made."""
        return self._budget - len(self.costs)

    @property
    def best(self) -> Vector:
        """The first point whose cost is least."""
        return self.points[int(np.argmin(self.costs))]

    @property
    def theta(self) -> Vector:
        """The same as theta."""
        found: Vector = self.best * SCALE
        return found


def grid(cost: Cost, start: Vector, budget: int, seed: int = 0) -> Vector:
    """Theta with the best theta_c of `POINTS`, the start's and equidistant ones up to `WIDEST`."""
    tried = Tried(cost, start, budget)
    for theta_c in np.linspace(start[-1], WIDEST, POINTS)[1:][: tried.left]:
        tried(np.r_[start[:-1], theta_c] / SCALE)
    return tried.theta


def spsa(
    cost: Cost,
    start: Vector,
    budget: int,
    seed: int = 0,
    *,
    step: float = STEP,
    perturbed: float = PERTURBED,
) -> Vector:
    """Simultaneous perturbation: two rollouts an iteration, on either side of theta.

    g = (y+ - y-) / (2 c_k) sign, theta <- theta - a_k g, with a_k = a / (k + 1 + A)^0.602 and
    c_k = perturbed / (k + 1)^0.101; `a` is such that the first step is `step` long in each
    component. A rollout that is left over judges the last theta.  Source: Spall (1998).
    """
    tried, rng = Tried(cost, start, budget), np.random.default_rng(seed)
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
    """CMA-ES, begun anew from the best point where it has converged; Hansen (2016).

    The first rollouts lie `spread` about it, in units of `SCALE`. Of a generation that the budget
    cuts off, the rollouts are made that it has room for.
    """
    import cma  # takes a second

    tried, again = Tried(cost, start, budget), 0
    while tried.left:
        options: dict[str, Any] = {
            "bounds": [tried.lower, tried.upper],
            "seed": 1 + (seed + 7919 * again) % (2**31 - 2),  # 0 would mean the clock
            "verbose": -9,
        }
        strategy = cma.CMAEvolutionStrategy(tried.best, spread, options)
        while tried.left and not strategy.stop():
            asked = strategy.ask()
            costs = [tried(one) for one in asked[: tried.left]]
            if len(costs) == len(asked):
                strategy.tell(asked, costs)
        again += 1
    return tried.theta


def bayesian(
    cost: Cost, start: Vector, budget: int, seed: int = 0, *, nearby: float = NEARBY
) -> Vector:
    """Bayesian optimisation by tree-structured Parzen estimators; Bergstra et al. (2011).

    Its first rollouts are drawn, from the box within `nearby` of the start: hardly any theta of the
    whole box brings the robot to its target.

    Raises:
        ImportError: Optuna is not installed; the extra `nmpcrl[search]` has it.
    """
    import optuna

    tried = Tried(cost, start, budget)
    names = [f"{k}: {name}" for k, name in enumerate(paper.THETA_NAMES)]
    lower = np.maximum(tried.lower, tried.best - nearby)
    upper = np.minimum(tried.upper, tried.best + nearby)
    box: dict[str, Any] = {
        name: optuna.distributions.FloatDistribution(*ends)
        for name, *ends in zip(names, lower, upper, strict=True)
    }
    shown = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)  # a line a rollout, else
    try:
        study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed))
        first = dict(zip(names, tried.best.tolist(), strict=True))
        study.add_trial(
            optuna.trial.create_trial(params=first, distributions=box, value=tried.costs[0])
        )
        while tried.left:
            trial = study.ask(box)
            study.tell(trial, tried(np.array([trial.params[name] for name in names])))
    finally:
        optuna.logging.set_verbosity(shown)
    return tried.theta


SEARCHES: dict[str, Search] = {
    "grid": grid, "SPSA": spsa, "CMA-ES": cma_es, "Bayes": bayesian,
}  # fmt: skip
