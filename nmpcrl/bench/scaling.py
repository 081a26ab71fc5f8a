"""How the time of a solve grows with the horizon and with the number of obstacles."""

import time
from dataclasses import replace

import numpy as np

from nmpcrl.bench.solves import THETA, Columns
from nmpcrl.control import Nmpc, Obstacle, Solution
from nmpcrl.study import paper

HORIZONS = (5, 10, 20, 40, 80)
OBSTACLES = (1, 4, 8, 16, 32)
BESIDE = [(x, y) for y in (8.5, 7.5, 6.5, 5.5) for x in np.linspace(-2.5, 8.5, 8)]  # the road [m]


def growth(episodes: int, steps: int) -> Columns:
    """The default solver in the closed loop without noise, one solve of every size in turn.

    Every size drives on its own. Obstacles are added beside the road, so that the plans, and with
    them the number of iterations, stay what they are.

    Returns:
        A row a warm solve: varied ("horizon" or "obstacles"), size, seconds, iterations.
    """
    rng = np.random.default_rng(3)
    problems = [("horizon", size, paper.nmpc(horizon=size)) for size in HORIZONS]
    problems += [("obstacles", size, _crowded(size)) for size in OBSTACLES]
    columns: Columns = {"varied": [], "size": [], "seconds": [], "iterations": []}
    for _ in range(episodes):
        states = [nmpc.task.start for _, _, nmpc in problems]
        plans: list[Solution | None] = [None] * len(problems)
        for t in range(steps):
            for i in rng.permutation(len(problems)):
                varied, size, nmpc = problems[i]
                began = time.perf_counter()
                plan = nmpc.solve(states[i], THETA, plans[i])
                seconds = time.perf_counter() - began
                states[i], plans[i] = nmpc.plant.step(states[i], plan.action), plan
                for name, value in zip(
                    columns, (varied, size, seconds, plan.iterations), strict=True
                ):
                    if t:  # the first solve of an episode is cold
                        columns[name].append(value)
    return columns


def _crowded(count: int) -> Nmpc:
    """The paper's controller with the first of its obstacles, and all others beside the road."""
    task, beside = paper.task(), [Obstacle(*centre) for centre in BESIDE]
    return Nmpc(
        plant=paper.nmpc().plant,
        task=replace(task, obstacles=(task.obstacles[0], *beside[: count - 1])),
        gamma=paper.GAMMA,
        slack_weight=paper.SLACK_WEIGHT,
    )
