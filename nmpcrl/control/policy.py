"""The policy of an NMPC at one theta, as simulators and other libraries call it."""

import pickle
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.blocks import by_name, numbers
from nmpcrl.control.content import Described
from nmpcrl.control.expression import refuse_other
from nmpcrl.control.nmpc import Nmpc
from nmpcrl.control.solution import Solution
from nmpcrl.control.vectors import floats

# of a `Problem`: a function of the time, or by name an array over the times of an episode
Data = Callable[[int], Mapping[str, Any]] | Mapping[str, Any]
Before = tuple[Solution | None, int]  # the plan of a call before, and the time of the next


class Policy(Described):
    """pi_theta(s) = u_0 of the plan from s: `policy = Policy(nmpc, theta); policy(state)`.

    A call begins from the plan before, one step later; `reset` begins an episode. A state without
    a plan raises `SolverError`.
    """

    def __init__(self, nmpc: Nmpc, theta: Vector | None = None, data: Data | None = None) -> None:
        """Keep an NMPC, its theta, shape (d,), that of the problem if absent, and data.

        `data` are those at each time t, the number of calls since `reset`: a function of t, or by
        name an array over the times, as in `train`; those of the problem if absent.
        """
        self.nmpc, self.data = nmpc, data
        self.theta = floats("theta", nmpc.problem.theta if theta is None else theta)
        self.solution: Solution | None = None  # of the last call
        self.time = 0  # of the next call
        _ = self._ahead  # refuses data that are no such thing

    @cached_property
    def _ahead(self) -> Callable[[int], dict[str, Any]]:
        return forecasts(self.data, self.nmpc.horizon)

    def __call__(self, state: Vector, *, data: Mapping[str, Any] | None = None) -> Vector:
        """The action in `state`, shape (m,); `data` as in `Nmpc.solve`, for this call alone."""
        known = self._ahead(self.time) if data is None else {"data": data}
        self.solution = self.nmpc.solve(state, self.theta, self.solution, **known)
        self.time += 1
        return self.solution.action

    def reset(self) -> None:
        """Forget the last plan, and begin at time 0."""
        self.solution, self.time = None, 0

    def make_step(self, x0: Any) -> Matrix:
        """The action in state `x0`, of any shape, as a column of shape (m, 1), as in do-mpc."""
        return self(np.ravel(np.asarray(x0, float)))[:, None]

    def predict(
        self,
        observation: Any,
        state: Sequence[Before] | None = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Vector, tuple[Before, ...]]:
        """Actions and the next `state`, as in Stable-Baselines3; the last call is not remembered.

        Args:
            observation: a state, shape (n,), or one of each environment, shape (k, n); the actions
                have the shape (m,) or (k, m).
            state: the plans before and the times, which the call before returned.
            episode_start: where an episode begins, shape (k,), and `state` does not count.
            deterministic: has no effect: the policy is deterministic.
        """
        states = np.atleast_2d(np.asarray(observation, float))
        before = list(state or [(None, 0)] * len(states))
        if episode_start is not None:
            begins = zip(before, np.ravel(episode_start), strict=True)
            before = [(None, 0) if start else one for one, start in begins]
        plans = [
            self.nmpc.solve(one, self.theta, plan, **self._ahead(t))
            for one, (plan, t) in zip(states, before, strict=True)
        ]
        actions = np.array([plan.action for plan in plans])
        after = tuple((plan, t + 1) for plan, (_, t) in zip(plans, before, strict=True))
        return actions.reshape((*np.shape(observation)[:-1], -1)), after

    def save(self, path: str | Path) -> None:
        """Write the controller and theta to a file."""
        Path(path).write_bytes(pickle.dumps(self))

    @staticmethod
    def load(path: str | Path) -> "Policy":
        """Read a policy that `save` wrote; a pickle runs code, so load only files you trust."""
        found = pickle.loads(Path(path).read_bytes())
        if not isinstance(found, Policy):
            raise ValueError(f"{path} holds a {type(found).__name__}; it must hold a Policy")
        return found

    def __getstate__(self) -> dict[str, Any]:
        return super().__getstate__() | {"solution": None, "time": 0}


def forecasts(data: Data | None, horizon: int) -> Callable[[int], dict[str, Any]]:
    """The options of `Nmpc.solve` at each time t of an episode: its data, or none.

    Of an array over the times, a plan at t sees t, ..., t + N, and the last entry beyond its end.
    """
    if data is None:
        return lambda _: {}
    if callable(data):
        refuse_other("data is called as data(t) and returns arrays by name", data, 1)
        return lambda t: {
            "data": {k: numbers(f"data {k}", one) for k, one in by_name("data", data(t)).items()}
        }
    series = {k: floats(f"data {k}", one) for k, one in by_name("data", data).items()}
    for name, values in series.items():
        if not values.ndim or not len(values):
            raise ValueError(f"data {name!r} must be an array with an axis of time in front")

    def window(t: int) -> dict[str, Any]:
        times = np.arange(t, t + horizon + 1)
        return {"data": {name: v[np.minimum(times, len(v) - 1)] for name, v in series.items()}}

    return window
