"""The environment that a controller acts in: it need not be what the NMPC plans with.

A `gymnasium.Env` is one, too: a reward is a cost with the other sign. What Gymnasium calls
terminated ends an episode in a state that is worth 0; after a truncation the state keeps its worth.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, cast

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Plant

# next state, cost l(s, a), whether the episode ends there, and whether only its time does
Step = tuple[Vector, float, bool, bool]
StepFunction = Callable[[Vector, Vector, np.random.Generator], tuple[Any, ...]]
# what is known at a time of an episode: of each, or one array a name with a time for each
Data = Callable[[int], Mapping[str, Any]] | Mapping[str, Any]
Start = Vector | Callable[[np.random.Generator], Vector]


class GymnasiumEnv(Protocol):
    """What is asked of a `gymnasium.Env`."""

    action_space: Any
    observation_space: Any

    def reset(self, *, seed: int | None = None) -> tuple[Any, Any]:
        """An observation, and more."""

    def step(self, action: Any) -> tuple[Any, Any, Any, Any, Any]:
        """Observation, reward, terminated, truncated, and more."""


@dataclass(frozen=True, eq=False)
class Environment:
    """A plant with its cost and its start."""

    step: Callable[[Vector, Vector, np.random.Generator], Step]
    start: Callable[[np.random.Generator], Vector]


def environment(
    nmpc: Nmpc,
    plant: Plant | StepFunction | GymnasiumEnv | None = None,
    start: Start | None = None,
) -> Environment:
    """The environment of an NMPC.

    Args:
        nmpc: has bounds, and where it has a task a start and the cost of Eq. (20).
        plant: a `Plant`, whose cost is the task's; or (state, action, rng) -> (next state, cost,
            end), for any other, such as a disturbed one, with any cost and end of its own. A fourth
            value, if there is one, ends the episode in a state that keeps its worth. Or a
            `gymnasium.Env`. The plant that plans if absent.
        start: a state, or rng -> state; the task's if absent. With the same start, no noise in the
            plant and no exploration, all seeds are one run: that they agree says nothing.

    Raises:
        ValueError: the NMPC is of a `Problem`, and plant or start is missing; or a `gymnasium.Env`
            has other sizes than the plan, or is given a start.
    """
    if is_gymnasium(plant):
        return of_gymnasium(cast(GymnasiumEnv, plant), nmpc, start)
    if nmpc.problem is not None and (start is None or plant is None or isinstance(plant, Plant)):
        raise ValueError(
            "a Problem plans, and says nothing of the environment, its start and its cost:"
            " give plant=(state, action, rng) -> (next state, cost, end), and start="
        )
    if plant is None or isinstance(plant, Plant):
        own, task = plant or nmpc.plant, nmpc.task
        if (own.n, own.m) != (nmpc.n, nmpc.m):
            raise ValueError(
                f"the plant has {own.n} states and {own.m} inputs, and the plan {nmpc.n} and"
                f" {nmpc.m}"
            )

        advance, charge = own.step, task.stage_cost

        def as_task(state: Vector, action: Vector, _: np.random.Generator) -> Step:
            return advance(state, action), charge(state, action), False, False

        step = as_task
    else:
        step = checked(cast(StepFunction, plant), nmpc.n)
    if start is None:
        start = nmpc.task.start
    return Environment(step, start if callable(start) else always(start))


def forecasts(data: Data | None, horizon: int) -> Callable[[int], Mapping[str, Any]] | None:
    """What `Nmpc.solve` is given as its data at each time; None where there are none.

    Of an array over the times of an episode, a plan at t sees t, ..., t + N; beyond its end the
    last one stays.
    """
    if data is None or callable(data):
        return data
    whole = {name: np.asarray(values, float) for name, values in data.items()}
    for name, values in whole.items():
        if not values.ndim or not len(values):
            raise ValueError(f"data {name!r} must be an array with an axis of time in front")

    def window(t: int) -> dict[str, Any]:
        times = np.arange(t, t + horizon + 1)
        return {name: v[np.minimum(times, len(v) - 1)] for name, v in whole.items()}

    return window


def always(start: Any) -> Callable[[np.random.Generator], Vector]:
    """The same start for every episode."""
    state = np.array(start, float)
    return lambda _: state


def is_gymnasium(plant: Any) -> bool:
    """Whether this is a `gymnasium.Env`, or acts like one."""
    return hasattr(plant, "reset") and hasattr(plant, "action_space")


def of_gymnasium(env: GymnasiumEnv, nmpc: Nmpc, start: Any = None) -> Environment:
    """The environment whose states are the observations of `env`, and its costs minus the rewards.

    Each episode resets `env` with a seed that the generator of the run draws.

    Raises:
        ValueError: its observations or actions are not those of the plan, or a start is given.
    """
    if start is not None:
        raise ValueError("a gymnasium.Env draws its own start: leave start= out")
    for name, size in (("observation_space", nmpc.n), ("action_space", nmpc.m)):
        space = getattr(env, name)
        if not hasattr(space, "low") or np.prod(space.shape) != size:
            raise ValueError(f"{name} = {space} must be a Box of {size} numbers, as in the plan")

    def begin(rng: np.random.Generator) -> Vector:
        observation, _ = env.reset(seed=int(rng.integers(2**31)))
        return np.array(observation, float).ravel()

    def step(_: Vector, action: Vector, __: np.random.Generator) -> tuple[Any, ...]:
        applied = np.asarray(action, env.action_space.dtype).reshape(env.action_space.shape)
        observation, reward, terminated, truncated, _ = env.step(applied)
        return observation, -float(reward), terminated, truncated

    return Environment(checked(step, nmpc.n), begin)


def checked(plant: StepFunction, states: int) -> Callable[..., Step]:
    """A plant of the user, whose results are looked at.

    Raises:
        ValueError: when it is called: a next state of another size, or that is not finite.
    """

    def step(state: Vector, action: Vector, rng: np.random.Generator) -> Step:
        try:
            later, cost, end, *cut = plant(state, action, rng)
        except (TypeError, ValueError) as error:
            raise ValueError(
                "plant is called as plant(state, action, rng) and returns (next state, cost, end):"
                f" {error}"
            ) from error
        later = np.array(later, float).reshape(-1)
        if later.size != states or not np.isfinite(later).all():
            raise ValueError(f"plant returned {later}; a state is {states} finite numbers")
        return later, float(cost), bool(end), any(cut)

    return step
