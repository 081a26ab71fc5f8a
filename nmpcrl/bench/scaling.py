"""How the time of a solve grows with the horizon and with the number of obstacles."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.bench.solves import THETA, Columns, transposed
from nmpcrl.control import Fatrop, Nmpc, Obstacle, Riccati, Solution, SolverError
from nmpcrl.study import paper

HORIZONS = (5, 10, 20, 40, 80)
OBSTACLES = (1, 4, 8, 16, 32)
ROWS = (8.5, 7.5, 6.5, 5.5)  # y of the obstacles beside the trajectory [m]
BESIDE = [(x, y) for y in ROWS for x in np.linspace(-2.5, 8.5, 8)]


def solve_times(episodes: int, steps: int) -> Columns:
    """The default solver in the closed loop without noise, one solve of every size in turn.

    Every size has a closed loop of its own. Obstacles are added beside the trajectory, so that the
    plans, and with them the number of iterations, stay what they are.

    Returns:
        A row a warm solve: varied ("horizon" or "obstacles"), size, seconds, iterations.
    """
    rng = np.random.default_rng(3)
    problems = [("horizon", size, paper.nmpc(horizon=size)) for size in HORIZONS]
    problems += [("obstacles", size, _crowded(size)) for size in OBSTACLES]
    rows = []
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
                if t:  # the first solve of an episode is cold
                    rows.append((varied, size, seconds, plan.iterations))
    return transposed("varied size seconds iterations", rows)


def _crowded(count: int) -> Nmpc:
    """The paper's controller with one of its obstacles, and all others beside the trajectory."""
    task, beside = paper.task(), [Obstacle(*centre) for centre in BESIDE]
    return Nmpc(
        plant=paper.nmpc().plant,
        task=replace(task, obstacles=(task.obstacles[0], *beside[: count - 1])),
        gamma=paper.GAMMA,
        slack_weight=paper.SLACK_WEIGHT,
    )


def time_horizons(
    states: Sequence[Vector],
    theta: Vector,
    horizons: Sequence[int] = HORIZONS,
    *,
    layout: str = "A",
    repetitions: int = 3,
) -> pd.DataFrame:
    """Time of a solve from a standing start, one row a state, horizon and solver.

    Riccati and fatrop take turns, in this process and with one thread, so that a change of the
    machine's speed meets both alike. Each solve is made twice and the second one counts: the first
    finds the processor's caches full of the other solver.

    Returns:
        Columns state (its number), horizon, solver, ms (the median of the repetitions), iterations,
        us_per_iteration (nan where the solver began more than once), value; nan where it failed.
    """
    controllers = {
        (horizon, solver.name): paper.nmpc(layout, horizon=horizon, solver=solver)
        for horizon in horizons
        for solver in (Riccati(starts=1), Fatrop())
    }
    for controller in controllers.values():
        controller.solve(paper.task(layout).start, theta)  # transcribes
    rows = []
    for _ in range(repetitions):
        for state in range(len(states)):
            for (horizon, solver), controller in controllers.items():
                place = {"state": state, "horizon": horizon, "solver": solver}
                try:
                    controller.solve(states[state], theta)
                    solution = controller.solve(states[state], theta)
                except SolverError:
                    rows.append(place)
                    continue
                each = 1e6 * solution.seconds / solution.iterations
                rows.append(
                    place
                    | {
                        "ms": 1e3 * solution.seconds,
                        "iterations": solution.iterations,
                        "us_per_iteration": np.nan if solution.restarts else each,
                        "value": solution.value,
                    }
                )
    return pd.DataFrame(rows).groupby(["state", "horizon", "solver"]).median().reset_index()


def exponents(timings: pd.DataFrame, column: str) -> dict[str, float]:
    """For each solver the exponent k of column ~ N^k, by least squares on the medians' logarithms.

    Args:
        timings: of `time_horizons`.
        column: "ms" or another.
    """
    medians = timings.groupby(["solver", "horizon"])[column].median().unstack("solver").dropna()
    across = np.log(medians.index.to_numpy(float))
    return {
        str(solver): float(np.polyfit(across, np.log(medians[solver].to_numpy()), 1)[0])
        for solver in medians
    }
