"""An `Experiment` is an immutable value that names one run."""

from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

import numpy as np

from nmpcrl.control import Task, solvers
from nmpcrl.control.nmpc import ABSURD
from nmpcrl.study import geometry, paper
from nmpcrl.study.learners import DECAYS, LEARNERS, NETWORKS, readers
from nmpcrl.study.parameters import (
    LARGEST_SEED,
    TRUTH,
    Allowed,
    ParameterError,
    number,
    numbers,
    one_of,
    positive,
    whole,
)

PAPER = ("ES", "DES", "RDES", "GES")  # the paper's learners
MAIN = (*PAPER, "TDC", "frozen")  # of the main table

MOST_EPISODES = 100_000  # 333 times the paper's: exploration has long ended
MOST_STEPS = 10_000  # 77 times the paper's; the robot arrives within 92
MOST_STAGES = 500  # of a plan: four times an episode; gamma^500 is 2e-7

LAYOUT = geometry.layout(paper.LAYOUTS)
POSE = geometry.pose(paper.LOWER, paper.UPPER)
STEP_SIZE = positive(ABSURD)  # with a larger one theta leaves the numbers in one step
TOLERANCE = number(solvers.LEAST_TOLERANCE, solvers.LARGEST_TOLERANCE)
THETA = numbers([number(-ABSURD, ABSURD)] * 9, f"9 numbers of size at most {ABSURD:g}")


def option(default: Any, allowed: Allowed, about: str) -> Any:
    """A field: its default, the values that are allowed, and a line of help."""
    return field(default=default, metadata={"allowed": allowed, "help": about})


@dataclass(frozen=True)
class Experiment:
    """One run; the defaults are the paper's.

    A field that `LEARNERS` names in `reads` is part of the keys of those learners' runs alone.
    ParameterError refuses other values.
    """

    learner: str = option("ES", one_of(LEARNERS), "Name of the learner.")
    seed: int = option(0, whole(0, LARGEST_SEED), "Seed of the noise and of the network.")
    episodes: int = option(paper.EPISODES, whole(1, MOST_EPISODES), "Episodes of training.")
    layout: str | tuple[tuple[float, float], ...] = option("A", LAYOUT, "Layout of the obstacles.")
    decay: str = option("step", one_of(DECAYS), "What k of Eq. (5) counts.")  # departure C
    decay_rate: float = option(paper.DECAY_RATE, positive(1), "c_epsilon, exploration's decay.")
    alpha: float = option(paper.ALPHA, STEP_SIZE, "Step size of theta.")
    beta: float = option(paper.BETA, STEP_SIZE, "Step size of w.")
    zeta: float = option(paper.ZETA, STEP_SIZE, "Learning rate of the network.")
    gated: bool = option(True, TRUTH, "Whether theta waits for a first fit.")  # departure G
    clipped: bool = option(True, TRUTH, "Whether noisy actions are clipped.")  # departure E
    constrained: bool = option(False, TRUTH, "Whether Q(s, a) replaces V(s).")  # departure F
    network: str = option("plain", one_of(NETWORKS), "Variant of the network.")  # departure H
    box: str = option("hard", one_of(paper.BOXES), "Bounds of the state.")  # departures A and M
    ties_active: bool = option(False, TRUTH, "Whether obstacles are closed sets.")  # departure L
    curvature: bool = option(True, TRUTH, "Whether TDC subtracts h.")
    projected: bool = option(True, TRUTH, "Whether TDC projects theta into [0, 10].")
    beta_tdc: float = option(paper.BETA_TDC, STEP_SIZE, "Step size of w in TDC.")
    theta: tuple[float, ...] = option(paper.THETA_INIT, THETA, "theta at the start of training.")
    steps: int = option(paper.STEPS, whole(1, MOST_STEPS), "Steps of an episode.")
    start: tuple[float, ...] = option(paper.START, POSE, "Pose where an episode begins.")
    target: tuple[float, ...] = option(paper.TARGET, POSE, "Pose that the robot is to reach.")
    horizon: int = option(paper.HORIZON, whole(1, MOST_STAGES), "N, the inputs of a plan.")
    solver: str = option("riccati", one_of(solvers.SOLVERS), "Solver of Eq. (2).")
    tolerance: float = option(solvers.TOLERANCE, TOLERANCE, "Tolerance of the solver.")
    evaluate_every: int = option(10, whole(1, MOST_EPISODES), "Episodes between evaluations.")

    def __post_init__(self) -> None:
        for one in fields(self):
            value = one.metadata["allowed"].check(one.name, getattr(self, one.name))
            object.__setattr__(self, one.name, value)
        if self.box == "printed" and any(np.greater(self.start, paper.PRINTED_UPPER)):
            raise ParameterError(f"start = {self.start} lies outside the box = 'printed'")
        if self.values_actions and not self.clipped:
            raise ParameterError(
                f"clipped = False leaves actions outside the OCP's bounds, which {self.learner}"
                f" with constrained = {self.constrained} cannot value"
            )

    @property
    def stated(self) -> dict[str, Any]:
        """The fields in the records."""
        return asdict(self)

    @property
    def task(self) -> Task:
        """The start, the target and the obstacles."""
        return paper.task(self.layout, box=self.box, start=self.start, target=self.target)

    @property
    def values_actions(self) -> bool:
        """Whether Q(s, a) proper is learned, with u_0 = a fixed, and not V(s)."""
        return self.constrained or LEARNERS[self.learner].valued

    @property
    def canonical(self) -> "Experiment":
        """The same run, with defaults in the fields that its learner does not read."""
        changed: dict[str, Any] = {
            one.name: one.default
            for one in fields(self)
            if getattr(self, one.name) != one.default
            and self.learner not in (readers(one.name) or LEARNERS)
        }
        return replace(self, **changed) if changed else self

    def __str__(self) -> str:
        place = f"layout {geometry.short_name(self.layout)}"
        return f"{self.learner} in {place}, decay per {self.decay}, seed {self.seed}"


def frozen_arm(experiment: Experiment) -> Experiment:
    """The baseline of a run: same noise and controller, and a constant theta."""
    return replace(experiment, learner="frozen", constrained=False).canonical
