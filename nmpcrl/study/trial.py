"""A `Trial` names a run of a user's own controller, learner or environment.

`fetch`, `fetch_all` and `run` take trials and experiments alike; their records have equal tables.
"""

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from nmpcrl.control import Nmpc
from nmpcrl.control.content import NoContent, content
from nmpcrl.learning import Learner
from nmpcrl.study.parameters import LARGEST_SEED, ParameterError, whole

COUNTS = ("episodes", "steps", "evaluate_every")
STATED = ("learner", "seed", *COUNTS, "theta")  # fields that the records have


@dataclass(frozen=True, eq=False)
class Trial:
    """One run with a user's own parts.

    The key of the run holds all fields: after an edit of a function the run is trained again, where
    a version raised by hand could be forgotten.
    Functions may be defined in a notebook. Generators and networks are made by `make`.
    ParameterError refuses a value that no key can be made of.
    """

    learner: str  #: name of the learner in tables and figures
    make: Callable[..., Learner]  #: (nmpc) -> learner, or (nmpc, rng) if it has an argument rng
    nmpc: Nmpc
    theta: Any = None  #: at the start; by default the theta of the `Problem`
    seed: int = 0  #: of the noise, of the environment and of `rng`
    episodes: int = 30
    steps: int = 100  #: of an episode, at most
    plant: Any = None  #: as in `train`, like the next two
    start: Any = None
    data: Any = None
    deviation: Any = 1.0  #: of the noise of Eq. (5), a number or one an input
    decay_rate: float = 0.99  #: c_epsilon, counted in time steps
    evaluate_every: int = 5  #: episodes between rollouts without noise

    def __post_init__(self) -> None:
        if not isinstance(self.nmpc, Nmpc):
            raise ParameterError(f"nmpc = {self.nmpc!r} must be an Nmpc")
        if not callable(self.make):
            raise ParameterError(f"make = {self.make!r} must be a function of nmpc")
        theta = self.theta
        if theta is None:
            if self.nmpc.task is not None:
                raise ParameterError("theta must be given where the Nmpc has a task and no Problem")
            theta = self.nmpc.problem.theta
        object.__setattr__(self, "theta", tuple(map(float, np.asarray(theta, float))))
        whole(0, LARGEST_SEED).check("seed", self.seed)
        for name in COUNTS:
            whole(1, 10**9).check(name, getattr(self, name))
        _ = self.identity  # refused here, and not where the run is stored

    @property
    def identity(self) -> dict[str, Any]:
        """The content of every field."""
        try:
            return {"trial": {one.name: content(getattr(self, one.name)) for one in fields(self)}}
        except NoContent as error:
            raise ParameterError(f"this trial cannot be stored: {error}") from error

    @property
    def stated(self) -> dict[str, Any]:
        """The fields in the records, and the sizes of the problem."""
        named = {name: getattr(self, name) for name in STATED} | {"theta": [*self.theta]}
        return named | {"states": self.nmpc.n, "inputs": self.nmpc.m}

    @property
    def solver(self) -> str:
        """The name of the solver."""
        return self.nmpc.solver.name

    @property
    def name(self) -> str:
        """The name of the run, without its key."""
        plain = re.sub(r"\W+", "_", self.learner)
        return f"{plain}-seed{self.seed}-{self.episodes}ep"

    def made(self, controller: Nmpc, rng: np.random.Generator) -> Learner:
        """A learner for one run."""
        takes = inspect.signature(self.make).parameters
        return self.make(controller, rng=rng) if "rng" in takes else self.make(controller)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Trial) and self.identity == other.identity

    def __hash__(self) -> int:
        return hash(self.name)

    def __str__(self) -> str:
        return f"{self.learner}, seed {self.seed}"
