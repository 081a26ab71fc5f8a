"""The policy of an NMPC at one theta, as simulators and other libraries call it."""

import pickle
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.content import Described
from nmpcrl.control.nmpc import Nmpc
from nmpcrl.control.solution import Solution


class Policy(Described):
    """pi_theta(s) = u_0 of the plan from s: `policy = Policy(nmpc, theta); policy(state)`.

    A call begins from the plan before; `reset` forgets it, as between two episodes. A state
    without a plan raises `SolverError`.
    """

    def __init__(self, nmpc: Nmpc, theta: Vector | None = None) -> None:
        """Keep an NMPC and its theta, shape (d,), that of the problem if absent."""
        self.nmpc = nmpc
        self.theta = np.array(nmpc.problem.theta if theta is None else theta, float)
        self.solution: Solution | None = None  # of the last call

    def __call__(self, state: Vector, *, data: Mapping[str, Any] | None = None) -> Vector:
        """The action in `state`, shape (m,); `data` as in `Nmpc.solve`."""
        self.solution = self.nmpc.solve(state, self.theta, self.solution, data=data)
        return self.solution.action

    def reset(self) -> None:
        """Forget the last plan."""
        self.solution = None

    def make_step(self, x0: Any) -> Matrix:
        """The action in state `x0`, of any shape, as a column of shape (m, 1), as in do-mpc."""
        return self(np.ravel(np.asarray(x0, float)))[:, None]

    def predict(
        self,
        observation: Any,
        state: Sequence[Solution | None] | None = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Vector, tuple[Solution | None, ...]]:
        """Actions and the next `state`, as in Stable-Baselines3; the last call is not remembered.

        Args:
            observation: a state, shape (n,), or one of each environment, shape (k, n); the actions
                have the shape (m,) or (k, m).
            state: the plans before, which the call before returned; none if absent.
            episode_start: where an episode begins, shape (k,), and no plan before counts.
            deterministic: has no effect: the policy is deterministic.
        """
        states = np.atleast_2d(np.asarray(observation, float))
        starts = np.zeros(len(states), bool) if episode_start is None else np.ravel(episode_start)
        plans = tuple(
            self.nmpc.solve(one, self.theta, None if start else before)
            for one, before, start in zip(
                states, state or [None] * len(states), starts, strict=True
            )
        )
        actions = np.array([plan.action for plan in plans])
        return actions.reshape((*np.shape(observation)[:-1], -1)), plans

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
        return super().__getstate__() | {"solution": None}
