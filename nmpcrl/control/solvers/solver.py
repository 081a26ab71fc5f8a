"""A solver of Eq. (2): a value with its options, which prepares itself for a problem."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

from nmpcrl import Matrix, Vector
from nmpcrl.control.diagnosis import SUBSTEPS
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.solution import Solution

TOLERANCE = 1e-8  # the default
LED_ASTRAY = f"led through numbers that are absurd: {SUBSTEPS}"
LEAST_TOLERANCE, LARGEST_TOLERANCE = 1e-12, 1e-2


class Asked(NamedTuple):
    """The arguments of a solve, checked: see `Nmpc.solve`."""

    state: Vector
    theta: Vector
    warm_start: Solution | None
    action: Vector  #: u_0, shape (m,), or (0,) where it is free
    data: Matrix  #: d_0, ..., d_N
    began: float  #: `time.perf_counter()` before the checks


class Prepared(Protocol):
    """A solver that is ready for one OCP."""

    def solve(self, asked: Asked) -> Solution:
        """An optimum; SolverError where none is found."""


@dataclass(frozen=True)
class Solver(ABC):
    """A way to solve Eq. (2), identified by `name`."""

    name: ClassVar[str]

    tolerance: float = TOLERANCE  #: of the KKT conditions, as the solver scales them

    def __post_init__(self) -> None:
        if not LEAST_TOLERANCE <= self.tolerance <= LARGEST_TOLERANCE:
            allowed = f"[{LEAST_TOLERANCE:g}, {LARGEST_TOLERANCE:g}]"
            raise ValueError(f"tolerance = {self.tolerance} must lie in {allowed}")
        object.__setattr__(self, "tolerance", float(self.tolerance))

    @abstractmethod
    def prepare(self, ocp: Ocp) -> Prepared:
        """Get ready for a problem."""
