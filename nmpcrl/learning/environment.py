"""The environment that a controller acts in: it need not be what the NMPC plans with.

A `gymnasium.Env` is one, too: a reward is a cost with the other sign. What Gymnasium calls
terminated ends an episode in a state that is worth 0; after a truncation the state keeps its worth.

Functions of the user are given copies, and what they return is copied, as numbers of type float.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Plant, Task
from nmpcrl.control.blocks import numbers
from nmpcrl.control.expression import mismatch
from nmpcrl.control.solution import short

# next state, cost l(s, a), whether the episode ends there, and whether only its time does
Step = tuple[Vector, float, bool, bool]
StepFunction = Callable[[Vector, Vector, np.random.Generator], tuple[Any, ...]]
GymnasiumEnv = Any  # a `gymnasium.Env`, which need not be installed
# of a `Problem`: a function of the time, or by name an array over the times of an episode
Data = Callable[[int], Mapping[str, Any]] | Mapping[str, Any]
Start = Vector | Callable[[np.random.Generator], Vector]
PLANT = "plant is called as plant(state, action, rng) and returns (next state, cost, end)"


@dataclass(frozen=True, eq=False)
class Environment:
    """A plant with its cost and its start."""

    step: Callable[[Vector, Vector, np.random.Generator], Step]
    start: Callable[[np.random.Generator], Vector]


def environment(
    nmpc: Nmpc | None,
    plant: Plant | StepFunction | GymnasiumEnv | None = None,
    start: Start | None = None,
) -> Environment:
    """The environment of an NMPC.

    Args:
        nmpc: has bounds, and where it has a task a start and the cost of Eq. (20). None if what
            plans is another controller.
        plant: a `Plant`, whose cost is the task's; or (state, action, rng) -> (next state, cost,
            end), for any other, such as a disturbed one, with any cost and end of its own. A fourth
            value, if there is one, ends the episode in a state that keeps its worth. It is given
            copies. Or a `gymnasium.Env`. The plant that plans if absent.
        start: a state, or rng -> state; the task's if absent. With the same start, no noise in the
            plant and no exploration, all seeds are one run: that they agree says nothing.

    Raises:
        ValueError: the NMPC is of a `Problem`, or there is none, and plant or start is missing; a
            function takes other arguments; or the plant has other sizes or narrower bounds than the
            plan; or a `gymnasium.Env` is given a start.
    """
    if is_gymnasium(plant):
        return of_gymnasium(plant, nmpc, start)
    states, task = (nmpc.n, nmpc.task) if nmpc else (None, None)
    if nmpc and task:
        start = task.start if start is None else start
        plant = nmpc.plant if plant is None else plant
    if start is None or plant is None or (isinstance(plant, Plant) and not task):
        raise ValueError(
            "a Problem plans, and says nothing of the environment, its start and its cost; nor does"
            " a controller without an Nmpc:"
            " give plant=(state, action, rng) -> (next state, cost, end), and start="
        )
    if nmpc and task and isinstance(plant, Plant):
        step = charged(plant, task, nmpc)
    else:
        refuse_other(PLANT, plant, 3)
        step = checked(cast(StepFunction, plant), states)
    return Environment(step, begun(start, states))


def charged(plant: Plant, task: Task, nmpc: Nmpc) -> Callable[..., Step]:
    """A plant with the cost of a task, Eq. (20); ValueError where it is too narrow for the plan."""
    if (plant.n, plant.m) != (nmpc.n, nmpc.m):
        raise ValueError(f"the plant has {plant.n} states and {plant.m} inputs, and the plan"
                         f" {nmpc.n} and {nmpc.m}")  # fmt: skip
    refuse_narrower("the plant's inputs", plant.lower, plant.upper, nmpc)
    advance, charge = plant.step, task.stage_cost

    def step(state: Vector, action: Vector, _: np.random.Generator) -> Step:
        return advance(state, action), charge(state, action), False, False

    return step


def forecasts(data: Data | None, horizon: int) -> Callable[[int], Mapping[str, Any]] | None:
    """The data of `Nmpc.solve` at each time t of an episode; None without data.

    Of an array over the times, a plan at t sees t, ..., t + N, and the last entry beyond its end.
    """
    if data is None:
        return None
    if callable(data):
        refuse_other("data is called as data(t) and returns arrays by name", data, 1)
        return lambda t: {name: numbers(f"data {name}", one) for name, one in data(t).items()}
    series = {name: np.array(values, float) for name, values in data.items()}
    for name, values in series.items():
        if not values.ndim or not len(values):
            raise ValueError(f"data {name!r} must be an array with an axis of time in front")

    def window(t: int) -> dict[str, Any]:
        times = np.arange(t, t + horizon + 1)
        return {name: v[np.minimum(times, len(v) - 1)] for name, v in series.items()}

    return window


def begun(start: Any, states: int | None) -> Callable[[np.random.Generator], Vector]:
    """The start of an episode, from a state or a function of the user."""
    if callable(start):
        refuse_other("start is called as start(rng) and returns a state", start, 1)
        return lambda rng: state_of("start returned", start(rng), states)
    state = state_of("start =", start, states)
    return lambda _: state.copy()


def ran_away(state: Vector, nmpc: Nmpc | None, *, end: bool = False) -> str:
    """Why no plan can begin in a state of the plant; "" if one can.

    A state in which an episode ends has to be finite only.
    """
    largest = np.inf if nmpc is None or end else nmpc.farthest
    if sum(map(abs, state.tolist())) < largest:  # false for nan, and faster than NumPy
        return ""
    if np.isfinite(state).all() and (np.abs(state) <= largest).all():
        return ""
    return (
        f"no plan can begin in state {short(state)}, to which the plant ran away: its numbers must"
        f" be finite and of size at most {largest:g}"
    )


def state_of(said: str, given: Any, states: int | None, *, finite: bool = True) -> Vector:
    """A copy of a user's state, shape (n,), or any where `states` is None; ValueError otherwise."""
    with suppress(TypeError, ValueError):
        state = np.array(given, float).reshape(-1)
        if state.size == (states or state.size) and not (finite and not np.isfinite(state).all()):
            return state
    raise ValueError(f"{said} {given}; a state is {states or 'a vector of'} finite numbers")


def refuse_other(usage: str, function: Any, arguments: int) -> None:
    """Refuse a function that does not take so many arguments."""
    wrong = mismatch(function, (None,) * arguments)
    if wrong:
        raise ValueError(f"{usage}: {wrong}")


def refuse_narrower(whose: str, low: Any, high: Any, nmpc: Nmpc) -> None:
    """Refuse an environment with bounds within those of the plan, which cuts actions off."""
    kind = np.asarray(low).dtype  # bounds of 32 bits need not be those of 64
    if (nmpc.lower.astype(kind) < low).any() or (nmpc.upper.astype(kind) > high).any():
        raise ValueError(
            f"{whose} lie between {short(low)} and {short(high)}, and those of the plan between"
            f" {short(nmpc.lower)} and {short(nmpc.upper)}: plan with lower= and upper= within the"
            " former, or what is learned on is not what was applied"
        )


def is_gymnasium(plant: Any) -> bool:
    """Whether this is a `gymnasium.Env`, or acts like one."""
    return hasattr(plant, "reset") and hasattr(plant, "action_space")


def of_gymnasium(env: GymnasiumEnv, nmpc: Nmpc | None, start: Any = None) -> Environment:
    """The environment whose states are the observations of `env`, and its costs minus the rewards.

    Each episode resets `env` with a seed that the generator of the run draws.

    Raises:
        ValueError: its observations or actions are not those of the plan, or a start is given.
    """
    if start is not None:
        raise ValueError("a gymnasium.Env draws its own start: leave start= out")
    sizes = (nmpc.n, nmpc.m) if nmpc else (None, None)
    for name, size in zip(("observation_space", "action_space"), sizes, strict=True):
        space = getattr(env, name)
        if not hasattr(space, "low") or (size and np.prod(space.shape) != size):
            raise ValueError(f"{name} = {space} must be a Box of {size} numbers, as in the plan")
    if not np.issubdtype(space.dtype, np.floating):
        raise ValueError(f"action_space = {space} must hold floats: whole numbers cut actions off")
    if nmpc:
        refuse_narrower("the environment's actions", space.low.ravel(), space.high.ravel(), nmpc)

    def begin(rng: np.random.Generator) -> Vector:
        observation, _ = env.reset(seed=int(rng.integers(2**31)))
        return state_of("env.reset returned", observation, sizes[0])

    def step(_: Vector, action: Vector, __: np.random.Generator) -> tuple[Any, ...]:
        applied = np.asarray(action, env.action_space.dtype).reshape(env.action_space.shape)
        observation, reward, terminated, truncated, _ = env.step(applied)
        return observation, -float(reward), terminated, truncated

    return Environment(checked(step, sizes[0]), begin)


def checked(plant: StepFunction, states: int | None) -> Callable[..., Step]:
    """A plant of the user, whose results are checked at each call; ValueError for a wrong one."""

    def step(state: Vector, action: Vector, rng: np.random.Generator) -> Step:
        result = plant(state.copy(), action.copy(), rng)
        try:
            later, cost, end, *cut = result
            paid, ended = np.array(cost, float).item(), bool(end)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{PLANT}: {error}") from error
        return state_of("plant returned", later, states, finite=False), paid, ended, any(cut)

    return step
