"""The environment that a controller acts in: it need not be what the NMPC plans with."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Plant

Step = tuple[Vector, float, bool]  # next state, cost l(s, a), whether the episode ends there
StepFunction = Callable[[Vector, Vector, np.random.Generator], Step]


@dataclass(frozen=True, eq=False)
class Environment:
    """A plant with its cost and its start."""

    step: StepFunction
    start: Callable[[np.random.Generator], Vector]


def environment(
    nmpc: Nmpc,
    plant: Plant | StepFunction | None = None,
    start: Vector | Callable[[np.random.Generator], Vector] | None = None,
) -> Environment:
    """The environment of an NMPC.

    Args:
        nmpc: has bounds, and where it has a task a start and the cost of Eq. (20).
        plant: a `Plant`, whose cost is the task's; or (state, action, rng) -> (next state, cost,
            end), for any other, such as a disturbed one, with any cost and end of its own. The
            plant that plans if absent.
        start: a state, or rng -> state; the task's if absent.

    Raises:
        ValueError: the NMPC is of a `Problem`, and plant or start is missing.
    """
    if nmpc.problem is not None and (start is None or plant is None or isinstance(plant, Plant)):
        raise ValueError(
            "a Problem plans, and says nothing of the environment, its start and its cost:"
            " give plant=(state, action, rng) -> (next state, cost, end), and start="
        )
    step: StepFunction
    if plant is None or isinstance(plant, Plant):
        own, task = plant or nmpc.plant, nmpc.task
        if (own.n, own.m) != (nmpc.n, nmpc.m):
            raise ValueError(
                f"the plant has {own.n} states and {own.m} inputs, and the plan {nmpc.n} and"
                f" {nmpc.m}"
            )

        advance, charge = own.step, task.stage_cost

        def as_task(state: Vector, action: Vector, _: np.random.Generator) -> Step:
            return advance(state, action), charge(state, action), False

        step = as_task
    else:
        step = checked(plant, nmpc.n)
    if start is None:
        start = nmpc.task.start
    return Environment(step, start if callable(start) else always(start))


def always(start: Any) -> Callable[[np.random.Generator], Vector]:
    """The same start for every episode."""
    state = np.array(start, float)
    return lambda _: state


def checked(plant: StepFunction, states: int) -> StepFunction:
    """A plant of the user, whose results are looked at.

    Raises:
        ValueError: when it is called: a next state of another size, or that is not finite.
    """

    def step(state: Vector, action: Vector, rng: np.random.Generator) -> Step:
        try:
            later, cost, end = plant(state, action, rng)
        except (TypeError, ValueError) as error:
            raise ValueError(
                "plant is called as plant(state, action, rng) and returns (next state, cost, end):"
                f" {error}"
            ) from error
        later = np.array(later, float).reshape(-1)
        if later.size != states or not np.isfinite(later).all():
            raise ValueError(f"plant returned {later}; a state is {states} finite numbers")
        return later, float(cost), bool(end)

    return step
