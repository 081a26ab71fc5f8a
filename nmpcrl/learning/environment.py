"""The environment: the plant, its cost and its start, which may differ from the NMPC's model.

A `gymnasium.Env` is one, too: a cost is minus its reward. A state in which Gymnasium terminates an
episode is worth 0; after a truncation a state keeps its worth. Functions of the user are given
copies, and their results are copied as floats.
"""

import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Plant, Task
from nmpcrl.control.expression import mismatch, refuse_other
from nmpcrl.control.policy import Data, forecasts
from nmpcrl.control.solution import short

if TYPE_CHECKING:
    from gymnasium import Env

# next state, cost l(s, a), whether the episode ends there, and whether only its time does
Step = tuple[Vector, float, bool, bool]
StepFunction = Callable[[Vector, Vector, np.random.Generator], tuple[Any, ...]]
Start = Vector | Callable[[np.random.Generator], Vector]
PLANT = "plant is called as plant(state, action, rng) and returns (next state, cost, end)"


@dataclass(frozen=True, eq=False)
class Environment:
    """A plant with its cost and its start."""

    step: Callable[[Vector, Vector, np.random.Generator], Step]
    start: Callable[[np.random.Generator], Vector]


def environment(
    nmpc: Nmpc,
    plant: Any = None,
    start: Start | None = None,
    data: Data | None = None,
) -> Environment:
    """The environment of an NMPC, checked.

    Args:
        nmpc: has bounds, and where it has a task a start and the cost of Eq. (20).
        plant: a `Plant`, whose cost is the task's; or (state, action, rng) -> (next state, cost,
            end), for any other, such as a disturbed one, with any cost and end of its own. A fourth
            value, if there is one, ends the episode in a state that keeps its worth. A function of
            (state, action, rng, t) is told the time, the steps since the start; and one of (state,
            action, rng, t, d) the data that a plan at t has, too. Or a `gymnasium.Env`. The plant
            that plans if absent.
        start: a state, or rng -> state; the task's if absent. With the same start, no noise in the
            plant and no exploration, all seeds are one run: that they agree says nothing.
        data: as in `train`.

    Raises:
        ValueError: plant or start is missing, as for a `Problem`, or does not fit the plan.
    """
    if hasattr(plant, "reset") and hasattr(plant, "action_space"):
        plant, start = of_gymnasium(plant, nmpc, start)
    task = nmpc.task
    if task:
        start = task.start if start is None else start
        plant = nmpc.plant if plant is None else plant
    if start is None or plant is None or (isinstance(plant, Plant) and not task):
        raise ValueError(
            "a Problem plans, and says nothing of the environment, its start and its cost:"
            " give plant=(state, action, rng) -> (next state, cost, end), and start="
        )
    if isinstance(plant, Plant):
        step = charged(plant, task, nmpc)
    else:
        fits = [k for k in (3, 4, 5) if callable(plant) and not mismatch(plant, (None,) * k)]
        if fits and 3 not in fits:
            ahead = forecasts(data, nmpc.horizon)
            plant, start = timed(plant, start, lambda t: (t, ahead(t).get("data"))[: fits[0] - 3])
        refuse_other(PLANT, plant, 3)
        step = checked(plant, nmpc.n)
    if callable(start):
        begin = start
        refuse_other("start is called as start(rng) and returns a state", begin, 1)
        return Environment(step, lambda rng: state_of("start returned", begin(rng), nmpc.n))
    first = state_of("start =", start, nmpc.n)
    return Environment(step, lambda _: first.copy())


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


def unusable(state: Vector, cost: float, nmpc: Nmpc, *, end: bool) -> str:
    """Why a step ends its episode as a failed solve does; "" if it does not.

    Its cost is not finite, or no plan can begin in its state; an episode may end in any finite one.
    """
    largest = sys.float_info.max if end else nmpc.farthest
    if all(abs(number) <= largest for number in state.tolist()):
        return "" if abs(cost) < np.inf else f"the plant's cost in state {short(state)} is {cost}"
    return (
        f"no plan can begin in state {short(state)}, to which the plant ran away: its numbers must"
        f" be finite and of size at most {largest:g}"
    )


def stream(rng: np.random.Generator | int, key: int) -> np.random.Generator:
    """A generator as it is, or one of an int, apart from the stream of `default_rng` of it."""
    if isinstance(rng, int | np.integer):
        rng = np.random.SeedSequence(int(rng), spawn_key=(key,))  # type: ignore[assignment]
    return np.random.default_rng(rng)


def state_of(said: str, given: Any, states: int, *, finite: bool = True) -> Vector:
    """A copy of a user's state, shape (n,); ValueError for any other."""
    with suppress(TypeError, ValueError):
        state = np.array(given, float).reshape(-1)
        if state.size == states and (not finite or np.isfinite(state).all()):
            return state
    raise ValueError(f"{said} {given}; a state is {states} finite numbers")


def refuse_narrower(whose: str, low: Any, high: Any, nmpc: Nmpc) -> None:
    """Refuse an environment with bounds within those of the plan, which cuts actions off."""
    kind = np.asarray(low).dtype  # bounds of 32 bits need not be those of 64
    if (nmpc.lower.astype(kind) < low).any() or (nmpc.upper.astype(kind) > high).any():
        raise ValueError(
            f"{whose} lie between {short(low)} and {short(high)}, and those of the plan between"
            f" {short(nmpc.lower)} and {short(nmpc.upper)}: plan with lower= and upper= within the"
            " former, or what is learned on is not what was applied"
        )


def of_gymnasium(
    env: Any, nmpc: Nmpc, start: Any
) -> tuple[StepFunction, Callable[[np.random.Generator], Vector]]:
    """`env` as plant and start: its observations are states, and minus its rewards are costs.

    Each episode resets `env` with a seed that the generator of the run draws.
    """
    if start is not None:
        raise ValueError("a gymnasium.Env draws its own start: leave start= out")
    for name, size in (("observation_space", nmpc.n), ("action_space", nmpc.m)):
        space = getattr(env, name)
        if not hasattr(space, "low") or np.prod(space.shape) != size:
            raise ValueError(f"{name} = {space} must be a Box of {size} numbers, as in the plan")
    if not np.issubdtype(space.dtype, np.floating):
        raise ValueError(f"action_space = {space} must hold floats: whole numbers cut actions off")
    refuse_narrower("the environment's actions", space.low.ravel(), space.high.ravel(), nmpc)

    def begin(rng: np.random.Generator) -> Any:
        return env.reset(seed=int(rng.integers(2**31)))[0]

    def step(_: Vector, action: Vector, __: np.random.Generator) -> tuple[Any, ...]:
        applied = np.asarray(action, env.action_space.dtype).reshape(env.action_space.shape)
        observation, reward, terminated, truncated, _ = env.step(applied)
        return observation, -float(reward), terminated, truncated

    return step, begin


def timed(
    plant: Callable[..., Any], start: Start, more: Callable[[int], tuple[Any, ...]]
) -> tuple[StepFunction, Start]:
    """A plant as one of three arguments, given `more(t)`, too, and a start that sets t to 0."""
    clock = count()

    def begin(rng: np.random.Generator) -> Any:
        nonlocal clock
        clock = count()
        return start(rng) if callable(start) else start

    return lambda state, action, rng: plant(state, action, rng, *more(next(clock))), begin


def checked(plant: StepFunction, states: int) -> Callable[..., Step]:
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


def as_gymnasium(
    nmpc: Nmpc, *, plant: Any = None, start: Any = None, steps: int | None = None
) -> "Env[Vector, Vector]":
    """The environment of an NMPC as a `gymnasium.Env`, whose reward is minus the cost.

    `plant` and `start` are those of `train`; after `steps` an episode is truncated. Gymnasium comes
    with the extra `nmpcrl[gymnasium]`.
    """
    import gymnasium

    around = environment(nmpc, plant, start)
    box: Any = gymnasium.spaces.Box

    class NmpcEnv(gymnasium.Env[Vector, Vector]):
        """The start, the steps, the costs and the ends of `train`."""

        metadata = {"render_modes": []}  # noqa: RUF012 as Gymnasium has it

        def __init__(self) -> None:
            self.observation_space = box(-np.inf, np.inf, (nmpc.n,), float)
            self.action_space = box(nmpc.lower, nmpc.upper, dtype=float)

        def reset(
            self, *, seed: int | None = None, options: dict[str, Any] | None = None
        ) -> tuple[Vector, dict[str, Any]]:
            super().reset(seed=seed)
            self.state, self.time = around.start(self.np_random), 0
            return self.state.copy(), {}

        def step(self, action: Vector) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
            given = np.array(action, float).reshape(nmpc.m)
            later, cost, end, cut = around.step(self.state, given, self.np_random)
            self.state = state_of("plant returned", later, nmpc.n)
            self.time += 1
            return self.state.copy(), -cost, end, cut or self.time == steps, {}

    return NmpcEnv()
