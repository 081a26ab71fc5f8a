"""How times grow with the sizes of a `Problem`: to compile, to solve and to differentiate it."""

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from nmpcrl.control import Nmpc, Problem, Soft


class Sizes(NamedTuple):
    """Of a problem."""

    states: int = 4  # n, an even number
    inputs: int = 1  # m
    horizon: int = 10  # N
    parameters: int = 8  # d
    rows: int = 2  # of each stage


VARIED: dict[str, Sequence[int]] = {
    "states": (2, 4, 8, 12),
    "inputs": (1, 4),
    "horizon": (5, 10, 20, 40),
    "parameters": (4, 8, 32),
    "rows": (0, 2, 8),
}
SOLVES, SEED = 200, 5


def chain(sizes: Sizes) -> Problem:
    """Pendulums in a row, coupled by springs, the first of which are turned by the inputs."""
    half, rng = sizes.states // 2, np.random.default_rng(SEED)
    push = rng.uniform(0.5, 1.5, (half, sizes.inputs))
    spread = rng.normal(scale=0.1, size=(half, sizes.parameters))
    limits = rng.normal(size=(sizes.rows, half))

    def model(x: Any, u: Any, th: Any) -> list[Any]:
        force, faster = push @ u + spread @ th["all"], []
        for k in range(half):
            beside = x[max(k - 1, 0)] + x[min(k + 1, half - 1)] - 2 * x[k]
            faster.append(x[half + k] + 0.1 * (force[k] + 0.5 * beside - np.sin(x[k])))
        return [x[k] + 0.1 * x[half + k] for k in range(half)] + faster

    return Problem(
        states=sizes.states,
        inputs=sizes.inputs,
        horizon=sizes.horizon,
        gamma=0.97,
        theta={"all": np.linspace(0.5, 1.0, sizes.parameters)},
        model=model,
        stage=lambda x, u, th: x.T @ x + 0.1 * th["all"][0] * (u.T @ u),
        terminal=lambda x, th: 5 * (x.T @ x),
        soft=[Soft(lambda x, u, th: limits @ x[:half] - 0.3, weight=5.0)] if sizes.rows else (),
        lower=-1.0,
        upper=1.0,
    )


def times(
    varied: Sequence[str] = tuple(VARIED),
    *,
    measure: Callable[[Sizes], dict[str, float]] | None = None,
) -> pd.DataFrame:
    """A row a size: every size of `VARIED` in turn, the others as `Sizes` has them.

    Args:
        varied: names of `VARIED`.
        measure: takes the times of one problem; `measured` if absent, in this process and with the
            machine code that is kept.

    Returns:
        Columns varied, size, and what `measured` returns.
    """
    found: dict[Sizes, dict[str, float]] = {}
    rows = []
    for name in varied:
        for size in VARIED[name]:
            sizes = Sizes(**{name: size})
            if sizes not in found:
                found[sizes] = (measure or measured)(sizes)
            rows.append({"varied": name, "size": size, **found[sizes]})
    return pd.DataFrame(rows)


def measured(sizes: Sizes, solves: int = SOLVES, solver: str = "riccati") -> dict[str, float]:
    """The times of one problem; the solver goes from one drawn state to a near one, warm.

    Returns:
        Of the processor's time: first_s (until the first solution and its derivatives are there:
        what compiling takes, where it is not kept yet), solve_us (value and gradient, the median),
        iterations (likewise), hessian_us (a product with a vector), policy_us (the derivative of
        the policy in all of theta) and fatrop_us (value and gradient by fatrop).
    """
    began = time.process_time()
    problem, rng = chain(sizes), np.random.default_rng(SEED)
    nmpc, theta, along = Nmpc(problem, solver=solver), problem.theta, np.ones(sizes.parameters)
    state = rng.uniform(-0.3, 0.3, sizes.states)
    solution = nmpc.solve(state, theta)
    nmpc.value_hessian_times(solution, along)
    nmpc.policy_jacobian(solution)
    first = time.process_time() - began
    fatrop = Nmpc(problem, solver="fatrop")
    other, rows = fatrop.solve(state, theta), []
    for _ in range(solves):
        state = np.clip(state + rng.uniform(-0.02, 0.02, sizes.states), -0.5, 0.5)
        clock = [time.process_time()]
        solution = nmpc.solve(state, theta, solution)
        clock.append(time.process_time())
        nmpc.value_hessian_times(solution, along)
        clock.append(time.process_time())
        nmpc.policy_jacobian(solution)
        clock.append(time.process_time())
        other = fatrop.solve(state, theta, other)
        clock.append(time.process_time())
        rows.append((*np.diff(clock), solution.iterations))
    solve, hessian, policy, others, iterations = np.median(rows, axis=0).tolist()
    return {
        "first_s": first,
        "solve_us": 1e6 * solve,
        "iterations": iterations,
        "hessian_us": 1e6 * hessian,
        "policy_us": 1e6 * policy,
        "fatrop_us": 1e6 * others,
    }
