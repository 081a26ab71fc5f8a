"""How long one solve takes: every solver on the same problems, and the default in its own loop."""

import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.bench import baselines
from nmpcrl.control import Nmpc, Problem, Riccati, Solution, SolverError
from nmpcrl.control.solvers.riccati import machine_code
from nmpcrl.learning import QNetwork
from nmpcrl.study import paper

Columns = dict[str, list[Any]]  # lists of one length, by name
Solve = Callable[..., Any]  # (state, theta, warm_start) -> what has value and iterations

THETA = np.array(paper.THETA_INIT)
LOOPS = {"without noise": 0.0, "with noise": paper.NOISE}  # that of training's first episode
WIDTH = 3 + 2 + len(THETA)  # of the input of RDES's network: (s, a, theta)
STRETCH = 26  # problems that a solver is given at a time: then its code is in the caches, as in use


def transposed(names: str, rows: Iterable[tuple[Any, ...]]) -> Columns:
    """Rows as columns with these names, written between blanks."""
    listed = list(rows)
    return {name: [row[i] for row in listed] for i, name in enumerate(names.split())}


def columns_of(table: pd.DataFrame) -> Columns:
    """The columns of a table, with None where there is no number: JSON knows no nan."""
    objects = table.astype(object)
    columns: Columns = objects.where(objects.notna(), None).to_dict("list")
    return columns


def solvers() -> dict[str, Solve]:
    """From the default to what is slowest, all with the value's gradient."""
    named: dict[str, Solve] = {
        name: paper.nmpc(solver=name).solve for name in ("riccati", "fatrop", "ipopt")
    }
    nmpc = paper.nmpc()
    return named | {"ipopt MX": baselines.mx(nmpc), "rebuilt": baselines.rebuilt(nmpc)}


def interleaved(episodes: int, steps: int) -> Columns:
    """Every solver on the problems of the same recorded closed loops, each from its own last plan.

    The solvers take turns, a stretch of problems each, in an order drawn anew every time, so that
    a change of the machine's speed meets all alike.

    Returns:
        A row a solve: loop, solver, warm (false for the first of an episode), seconds, iterations
        (None where it failed), suboptimality (of the value over the best of all solvers, relative
        to the best or to 1, whichever is larger).
    """
    rng, named = np.random.default_rng(0), solvers()
    for solve in named.values():
        solve(np.array(paper.START), THETA, None)  # the first call compiles
    rows = []
    for loop, noise in LOOPS.items():
        for _ in range(episodes):
            states = [state for state, _, _ in closed_loop(paper.nmpc(), noise, rng, steps)]
            rows += [(loop, *row) for row in _episode(states, named, rng)]
    return transposed("loop solver warm seconds iterations suboptimality", rows)


def _episode(
    states: list[Vector], named: dict[str, Solve], rng: np.random.Generator
) -> Iterator[tuple[Any, ...]]:
    plans: dict[str, list[Any]] = {name: [] for name in named}
    times: dict[str, list[float]] = {name: [] for name in named}
    for first in range(0, len(states), STRETCH):
        for name in rng.permutation(list(named)):
            warm_start = plans[name][-1] if first else None
            for state in states[first : first + STRETCH]:
                began = time.perf_counter()
                try:
                    warm_start = named[name](state, THETA, warm_start)
                except SolverError:
                    warm_start = None
                times[name].append(time.perf_counter() - began)
                plans[name].append(warm_start)
    for t in range(len(states)):
        found = {name: plans[name][t] for name in named}
        best = min(plan.value for plan in found.values() if plan)
        for name, plan in found.items():
            suboptimality = (plan.value - best) / max(1.0, best) if plan else None
            yield name, t > 0, times[name][t], plan and plan.iterations, suboptimality


def own_loop(episodes: int, steps: int) -> Columns:
    """The default solver alone with the plant, the loops in turn: seconds of each warm solve."""
    nmpc, rng = paper.nmpc(), np.random.default_rng(1)
    rows = []
    for _ in range(episodes):
        for loop, noise in LOOPS.items():
            rows += [(loop, took) for _, _, took in closed_loop(nmpc, noise, rng, steps)][1:]
    return transposed("loop seconds", rows)


def closed_loop(
    nmpc: Nmpc, noise: float, rng: np.random.Generator, steps: int
) -> Iterator[tuple[Vector, Solution, float]]:
    """The closed loop from the start: each state, its solution, and how long the solve took [s]."""
    state, solution = nmpc.task.start, None
    for _ in range(steps):
        began = time.perf_counter()
        solution = nmpc.solve(state, THETA, solution)
        yield state, solution, time.perf_counter() - began
        action = nmpc.plant.clip(solution.action + rng.normal(scale=noise, size=nmpc.plant.m))
        state = nmpc.plant.step(state, action)


def parts(episodes: int) -> Columns:
    """What a solve and the rest of a learning step are made of: part, seconds (medians).

    Measured in the closed loop without noise, for so many episodes.
    """
    (nmpc, compiled), network = watched(), _network()
    spent: dict[str, list[float]] = {}
    for _ in range(episodes):
        for state, solution, seconds in closed_loop(
            nmpc, 0.0, np.random.default_rng(0), paper.STEPS
        ):
            inner, action = compiled[-1], solution.action
            spent.setdefault("solve, compiled part", []).append(inner)
            spent.setdefault("solve, Python around it", []).append(seconds - inner)
            again = partial(nmpc.solve, state, THETA, solution)
            _time(spent, "solve from a solution in the same state", again)
            _time(spent, "step of the plant", partial(nmpc.plant.step, state, action))
            _time(spent, "cost of a step", partial(nmpc.task.stage_cost, state, action))
    for _ in range(episodes * paper.STEPS):
        _time(spent, "fit of the network", network.fit)
        _time(spent, "prediction of the network", partial(network.predict, np.ones(WIDTH)))
    return {"part": list(spent), "seconds": [float(np.median(times)) for times in spent.values()]}


def _time(spent: dict[str, list[float]], name: str, call: Callable[[], Any]) -> None:
    began = time.perf_counter()
    call()
    spent.setdefault(name, []).append(time.perf_counter() - began)


def watched() -> tuple[Nmpc, list[float]]:
    """A controller that has solved once, and a list to which it adds its machine code's times."""
    seconds: list[float] = []

    def timing(problem: Problem) -> Any:
        code = machine_code(problem)

        def timed(*arguments: Any) -> Any:
            began = time.perf_counter()
            result = code(*arguments)
            seconds.append(time.perf_counter() - began)
            return result

        return timed

    nmpc = paper.nmpc(solver=Riccati(code=timing))
    nmpc.solve(nmpc.task.start, THETA)
    return nmpc, seconds


def _network() -> QNetwork:
    """RDES's network with an episode in its buffer."""
    rng = np.random.default_rng(0)
    network = QNetwork(WIDTH, rng, learning_rate=paper.ZETA, batch=paper.BATCH)
    for row in rng.normal(size=(paper.STEPS, WIDTH)):
        network.remember(row, 0.0)
    return network
