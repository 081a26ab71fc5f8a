"""How long one solve takes: every solver on the same problems, and what a solve is made of.

Times are the processor's, which other programs do not make longer.
"""

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.bench import baselines
from nmpcrl.control import Nmpc, Problem, Riccati, Solution, SolverError
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.control.solvers.riccati import machine_code
from nmpcrl.study import paper

Solve = Callable[..., Any]  # (state, theta, warm_start) -> what has value and iterations

THETA = np.array(paper.THETA_INIT)
LOOPS = {"without noise": 0.0, "with noise": paper.NOISE}  # that of training's first episode
STRETCH = 26  # problems that a solver is given at a time: then its code is in the caches, as in use
WORSE = 1e-6  # a value this much above the best, relative to it or to 1, is a worse minimum


def solvers(layout: str = "A", horizon: int = paper.HORIZON) -> dict[str, Solve]:
    """From the default to what is slowest, all with the value's gradient in theta.

    riccati, fatrop and ipopt are those of `Nmpc`; "ipopt MX" and "rebuilt" are `bench.baselines`.
    """
    three = {name: paper.nmpc(layout, horizon=horizon, solver=name) for name in SOLVERS}
    named: dict[str, Solve] = {name: nmpc.solve for name, nmpc in three.items()}
    problem = three["riccati"]
    return named | {"ipopt MX": baselines.mx(problem), "rebuilt": baselines.rebuilt(problem)}


def compare(named: dict[str, Solve], nmpc: Nmpc, steps: int = paper.STEPS) -> pd.DataFrame:
    """Warm solves of the same recorded closed loops by each solver, each from its own last plan.

    The solvers take turns, a stretch of problems each, in an order drawn anew every time, so that
    a change of the machine's speed meets all alike. `nmpc` acts in the loops, of so many steps.

    Columns, a row a loop and solver: median, p95 and max [us], times (the median over that of the
    first solver in `named`), iterations (the mean), and worse and failed: the shares of the
    problems in which it ends above the best value of all (`WORSE`) and finds no optimum.
    """
    rng, rows = np.random.default_rng(0), []
    for solve in named.values():
        solve(nmpc.task.start, THETA, None)  # the first call compiles
    for loop, noise in LOOPS.items():
        states = [state for state, _, _ in closed_loop(nmpc, noise, rng, steps)]
        rows += [{"loop": loop, **row} for row in _in_turns(states, named, rng)]
    solves = pd.DataFrame(rows)
    warm = solves[solves.warm].assign(
        micro=1e6 * solves.seconds, worse=solves.above > WORSE, failed=solves.above.isna()
    )
    each = warm.groupby(["loop", "solver"], sort=False)
    median = each.micro.median()
    table = {"median": median, "p95": each.micro.quantile(0.95), "max": each.micro.max()}
    table["times"] = median / median.groupby("loop").transform("first")
    return pd.DataFrame(table | {k: each[k].mean() for k in ("iterations", "worse", "failed")})


def _in_turns(
    states: list[Vector], named: dict[str, Solve], rng: np.random.Generator
) -> list[dict[str, Any]]:
    """A row a state and solver: solver, warm, seconds, iterations, above; nan where it failed."""
    plans: dict[str, list[Any]] = {name: [] for name in named}
    times: dict[str, list[float]] = {name: [] for name in named}
    for first in range(0, len(states), STRETCH):
        for name in rng.permutation(list(named)):
            warm_start = plans[name][-1] if first else None
            for state in states[first : first + STRETCH]:
                began = time.process_time()
                try:
                    warm_start = named[name](state, THETA, warm_start)
                except SolverError:
                    warm_start = None
                times[name].append(time.process_time() - began)
                plans[name].append(warm_start)
    rows = []
    for t in range(len(states)):
        best = min(plan[t].value for plan in plans.values() if plan[t])
        for name in named:
            plan, row = plans[name][t], {"solver": name, "warm": t > 0, "seconds": times[name][t]}
            above = (plan.value - best) / max(1.0, best) if plan else np.nan
            rows.append(row | {"iterations": plan.iterations if plan else np.nan, "above": above})
    return rows


def closed_loop(
    nmpc: Nmpc, noise: float, rng: np.random.Generator, steps: int
) -> Iterator[tuple[Vector, Solution, float]]:
    """The closed loop from the start: each state, its solution, and how long the solve took [s]."""
    state, solution = nmpc.task.start, None
    for _ in range(steps):
        began = time.process_time()
        solution = nmpc.solve(state, THETA, solution)
        yield state, solution, time.process_time() - began
        action = nmpc.plant.clip(solution.action + rng.normal(scale=noise, size=nmpc.plant.m))
        state = nmpc.plant.step(state, action)


def parts(layout: str = "A", horizon: int = paper.HORIZON, episodes: int = 3) -> pd.Series:
    """Median times [us] of riccati in its own closed loop without noise, by part.

    solve, of it compiled, and solve again: from the solution of a solve in the same state.
    """
    seconds: list[float] = []

    def timing(problem: Problem) -> Any:
        code = machine_code(problem)

        def timed(*arguments: Any) -> Any:
            began = time.process_time()
            result = code(*arguments)
            seconds.append(time.process_time() - began)
            return result

        return timed

    nmpc, rows = paper.nmpc(layout, horizon=horizon, solver=Riccati(code=timing)), []
    for _ in range(episodes):
        for state, solution, solve in closed_loop(nmpc, 0.0, np.random.default_rng(), paper.STEPS):
            compiled, began = seconds[-1], time.process_time()
            nmpc.solve(state, THETA, solution)
            rows.append((solve, compiled, time.process_time() - began))
    names = ["solve", "of it compiled", "solve again"]
    return 1e6 * pd.DataFrame(rows, columns=names).median()
