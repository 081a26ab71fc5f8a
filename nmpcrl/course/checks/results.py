"""The exercises of Chapter 5."""

from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.claims import rule
from nmpcrl.claims.verdict import REPRODUCED
from nmpcrl.course import Outcome, choice, function, number


def enough(answer: Any) -> Outcome:
    """The least number of runs that the rule calls reproduced if all of them agree."""
    return number(
        answer,
        next(n for n in range(1, 100) if rule.read(n, n) == REPRODUCED),
        tolerance=1e-3,
        mistakes={
            3: "With 3 of 3 the lower end is 3 / 6.84, below one half.",
            2: "With 2 of 2 the lower end is 2 / 5.84, far below one half.",
            5: "That is enough, and it is not the least number.",
        },
    )


def missing(answer: Any) -> Outcome:
    """The most of twenty that may be missing if the others say yes."""
    asked = 20
    reproduced = [gone for gone in range(asked) if rule.read(asked - gone, asked) == REPRODUCED]
    return number(
        answer,
        max(reproduced),
        tolerance=1e-3,
        mistakes={
            0: "A few may be missing: what if all of these had said no?",
            5: "The interval of 15 of 20 lies above one half, but 15 of 20 is not nine tenths.",
            16: "Four yes suffice if four are asked. Here twenty are, and 16 might say no.",
        },
    )


def fall(answer: Any) -> Outcome:
    """What a training cost, a baseline's and a rollout without noise say together."""
    return choice(
        answer,
        "c",
        {
            "a": "The baseline learned nothing, and its cost fell by more.",
            "b": "Noise does not cost two policies the same, so the difference is not theirs.",
            "c": "the rollout without noise is about the policy alone, and the baseline shows "
            "what decaying noise does.",
            "d": "The third number has no noise in it.",
        },
    )


def drawdown(answer: Any) -> Outcome:
    """The largest rise above the lowest cost so far, of random curves, some with failures."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        costs = np.round(4000 * np.exp(rng.normal(0, 0.2, rng.integers(4, 8))))
        if rng.random() < 0.2:
            costs[rng.integers(1, costs.size)] = np.nan
        return {"costs": costs}

    def rise(costs: Vector) -> Any:
        return max(float(late - min(costs[: k + 1])) for k, late in enumerate(costs)) / costs[0]

    def right(costs: Vector) -> Any:
        return rise(np.where(np.isnan(costs), np.inf, costs))

    return function(
        answer,
        right,
        draw,
        mistakes={
            "A failed rollout must not be left out: it is the worst that can happen.": (
                lambda costs: rise(costs[~np.isnan(costs)])
            ),
            "That is the range, which charges a run for improving, too.": (
                lambda costs: np.ptp(np.nan_to_num(costs, nan=np.inf)) / costs[0]
            ),
        },
    )


def pairs(answer: Any) -> Outcome:
    """Ratios of runs and their baselines, in tables of different order."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        cells = pd.MultiIndex.from_product([list("ABC"), range(4)], names=["layout", "seed"])
        base = pd.Series(rng.uniform(2000, 6000, len(cells)), cells, name="cost")
        runs = (base * rng.uniform(0.8, 2, len(cells))).rename("cost")
        shuffled = (one.sample(frac=1, random_state=rng).reset_index() for one in (runs, base))
        return dict(zip(("runs", "frozen"), shuffled, strict=True))

    def ratios(runs: pd.DataFrame, frozen: pd.DataFrame) -> Any:
        arm = frozen.set_index(["layout", "seed"]).cost
        own = zip(runs.layout, runs.seed, runs.cost, strict=True)
        return np.array([cost / arm[layout, seed] for layout, seed, cost in own])

    return function(
        answer,
        ratios,
        draw,
        mistakes={
            "Rows are paired by their position: shuffle one table and look at the result.": (
                lambda runs, frozen: runs.cost.to_numpy() / frozen.cost.to_numpy()
            ),
            "Both tables are sorted, and so is the result: its order is not that of the runs.": (
                lambda runs, frozen: ratios(runs.sort_values(["layout", "seed"]), frozen)
            ),
            "That is the mean of all baselines; each run has its own.": (
                lambda runs, frozen: runs.cost.to_numpy() / frozen.cost.mean()
            ),
        },
    )


def line(answer: Any) -> Outcome:
    """The line of `one_file.py` by which noise decays with the episode."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        return {"noise": rng.normal(size=(rng.integers(3, 6), rng.integers(6, 9), 2))}

    def decayed(noise: Any, exponent: Any = None) -> Any:
        episode = np.arange(len(noise)).reshape(-1, 1, 1) if exponent is None else exponent
        return noise * 0.99**episode

    def per_step(noise: Any) -> Any:
        return decayed(noise, np.arange(noise[..., 0].size).reshape(*noise.shape[:2], 1))

    return function(
        answer,
        decayed,
        draw,
        mistakes={
            "That is the decay per step, as the file has it.": per_step,
            "So each episode begins anew: the factor is to fall from episode to episode.": (
                lambda noise: decayed(noise, np.arange(noise.shape[1]).reshape(-1, 1))
            ),
            "The first episode has the factor 1.": lambda noise: 0.99 * decayed(noise),
        },
    )
