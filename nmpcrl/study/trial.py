"""A `Trial` names a run of one's own: any controller, learner and environment.

`fetch`, `fetch_all` and `run` take it as they take an `Experiment`, which names a run of the
paper's robot. Its records have the same tables.
"""

import inspect
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from nmpcrl.control import Nmpc
from nmpcrl.control.content import NoContent, content
from nmpcrl.learning import Learner
from nmpcrl.learning.rollout import Persistent
from nmpcrl.study.parameters import LARGEST_SEED, ParameterError, whole

AT_LEAST_ONE = ("episodes", "steps", "evaluate_every", "rollouts")
ABOUT = ("learner", "seed", *AT_LEAST_ONE, "theta")  # fields that its records state
MOST = 10**9


@dataclass(frozen=True, eq=False)
class Trial:
    """One run of one's own.

    All that it is made of is part of its key: edit a function, and the run is done again. Functions
    may stand in a notebook. What draws anew, such as a generator or a network, is made by `make`.

    Raises:
        ParameterError: a field is not what it may be, or no name can be made of it.
    """

    learner: str  # its name in tables and figures
    make: Callable[..., Learner]  # (nmpc) -> learner, or (nmpc, rng) if it has an argument rng
    nmpc: Nmpc
    theta: Any = None  # to start with; that of the `Problem` if None
    seed: int = 0  # of the noise, of the environment and of `rng`
    episodes: int = 30
    steps: int = 100  # of an episode, at most
    plant: Any = None  # this and the next two as in `train`
    start: Any = None
    data: Any = None
    deviation: Any = 1.0  # of the noise of Eq. (5), a number or one an input
    decay_rate: float = 0.99  # c_epsilon, counted in time steps
    clipped: bool = True
    constrained: bool | None = None
    evaluate_every: int = 5  # episodes between rollouts without noise
    rollouts: int = 1  # whose mean cost judges theta; the same draws each time

    def __post_init__(self) -> None:
        object.__setattr__(self, "theta", tuple(map(float, self._first_theta())))
        whole(0, LARGEST_SEED).check("seed", self.seed)
        for name in AT_LEAST_ONE:
            whole(1, MOST).check(name, getattr(self, name))
        if not callable(self.make):
            raise ParameterError(f"make = {self.make!r} must be a function of nmpc: a learner is"
                                 " made anew for each run")  # fmt: skip
        _ = self.identity

    def _first_theta(self) -> Iterable[float]:
        if not isinstance(self.nmpc, Nmpc):
            raise ParameterError(f"nmpc = {self.nmpc!r} must be an Nmpc")
        if self.theta is not None:
            return np.asarray(self.theta, float)
        if self.nmpc.problem is None:
            raise ParameterError("theta must be given where the Nmpc has a task and no Problem")
        return self.nmpc.problem.theta

    @cached_property
    def identity(self) -> dict[str, Any]:
        """What it is made of, by field."""
        try:
            found = {one.name: content(getattr(self, one.name)) for one in fields(self)}
        except NoContent as error:
            raise ParameterError(f"this trial cannot be stored: {error}") from error
        return {"trial": found}

    @property
    def stated(self) -> dict[str, Any]:
        """What its records say that it is."""
        sizes = {"states": self.nmpc.n, "inputs": self.nmpc.m}
        named = {name: getattr(self, name) for name in ABOUT} | {"theta": [*self.theta]}
        return named | sizes

    @property
    def solver(self) -> str:
        """The name of the solver."""
        return self.nmpc.solver.name

    @property
    def name(self) -> str:
        """For people; the key says the rest."""
        plain = re.sub(r"\W+", "_", self.learner)
        return f"{plain}-seed{self.seed}-{self.episodes}ep"

    @property
    def environment(self) -> dict[str, Any]:
        """What `train` and `evaluate` take for it."""
        return {"plant": self.plant, "start": self.start, "data": self.data}

    def made(self, controller: Persistent, rng: np.random.Generator) -> Learner:
        """The learner, made for this run."""
        takes = inspect.signature(self.make).parameters
        return self.make(controller, rng=rng) if "rng" in takes else self.make(controller)

    def refuse_change(self) -> None:
        """Refuse to run under the name of what it was when it was made.

        Raises:
            ParameterError: something that a function of it reads has another value now.
        """
        if replace(self).identity != self.identity:
            raise ParameterError(f"{self}: what it is made of has changed since; make it anew")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Trial) and self.identity == other.identity

    def __hash__(self) -> int:
        return hash(str(self.identity))

    def __reduce__(self) -> tuple[Any, ...]:
        """By cloudpickle, which takes functions of a notebook along."""
        import cloudpickle

        values = {one.name: getattr(self, one.name) for one in fields(self)}
        return _unpacked, (cloudpickle.dumps(values),)

    def __str__(self) -> str:
        return f"{self.learner}, seed {self.seed}"


def _unpacked(packed: bytes) -> Trial:
    import cloudpickle

    return Trial(**cloudpickle.loads(packed))
