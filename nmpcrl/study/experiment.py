"""An `Experiment` is a frozen value that names one run."""

from dataclasses import Field, dataclass, field, fields, replace
from typing import Any

import numpy as np

from nmpcrl.control import Task, solvers
from nmpcrl.control.nmpc import ABSURD
from nmpcrl.study import paper
from nmpcrl.study.geometry import Layout, Pose, short_name
from nmpcrl.study.learners import DECAYS, LEARNERS, NETWORKS
from nmpcrl.study.parameters import (
    LARGEST_SEED,
    Allowed,
    Number,
    Numbers,
    OneOf,
    ParameterError,
    Truth,
    Whole,
)

PAPER = ("ES", "DES", "RDES", "GES")  # the paper's learners
MAIN = (*PAPER, "TDC", "frozen")  # of the main table

# Nothing sensible lies above these.
MOST_EPISODES = 100_000  # 333 times the paper's: exploration has long ended
MOST_STEPS = 10_000  # 77 times the paper's; the robot arrives within 92
MOST_STAGES = 500  # of a plan: four times an episode; gamma^500 is 2e-7

WITHIN = Pose(paper.LOWER, paper.UPPER)  # the box
STEP_SIZE = Number.above_zero(ABSURD)  # with more, theta leaves the numbers in one step


def option(default: Any, allowed: Allowed, about: str, *, optional: bool = False) -> Any:
    """A field: its default, what it may be, and a line of help.

    An optional one is read by the learners whose entry in `LEARNERS` names it. The others ignore
    it, and it is not part of their keys.
    """
    metadata = {"allowed": allowed, "help": about, "optional": optional}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True)
class Experiment:
    """One run; the defaults are the paper's.

    Raises:
        ParameterError: a field is not what it may be.
    """

    learner: str = option("ES", OneOf(LEARNERS), "What learns.")
    seed: int = option(0, Whole(0, LARGEST_SEED), "Of the noise and of the network.")
    episodes: int = option(paper.EPISODES, Whole(1, MOST_EPISODES), "Of training.")
    layout: str | tuple[tuple[float, float], ...] = option(  # centres are kept as text
        "A", Layout(paper.LAYOUTS), "Of the obstacles."
    )
    decay: str = option("step", OneOf(DECAYS), "What k of Eq. (5) counts.")  # departure C
    decay_rate: float = option(
        paper.DECAY_RATE, Number.above_zero(1), "c_epsilon, by which exploration decays."
    )
    alpha: float = option(paper.ALPHA, STEP_SIZE, "Step size of theta.", optional=True)
    beta: float = option(paper.BETA, STEP_SIZE, "Step size of w.", optional=True)
    zeta: float = option(paper.ZETA, STEP_SIZE, "Learning rate of the network.", optional=True)
    gated: bool = option(  # False: Algorithm 1 # departure G
        True, Truth(), "Whether theta waits for the network's first fit.", optional=True
    )
    clipped: bool = option(
        True, Truth(), "Whether noise is kept in the action space."
    )  # departure E
    constrained: bool = option(  # departure F
        False,
        Truth(),
        "Whether Q(s, a) is learned, with u_0 = a fixed, and not V(s).",
        optional=True,
    )
    network: str = option(  # departure H
        "plain", OneOf(NETWORKS), "What the paper leaves open of the network.", optional=True
    )
    box: str = option("hard", OneOf(paper.BOXES), "The bounds of the state.")  # departures A and M
    ties_active: bool = option(  # the other side of the kink # departure L
        False, Truth(), "Whether a state on an obstacle's boundary is in it.", optional=True
    )
    curvature: bool = option(True, Truth(), "Whether TDC subtracts h.", optional=True)
    projected: bool = option(
        True, Truth(), "Whether theta is projected into [0, 10].", optional=True
    )
    beta_tdc: float = option(paper.BETA_TDC, STEP_SIZE, "Step size of w in TDC.", optional=True)
    theta: tuple[float, ...] = option(
        paper.THETA_INIT,
        Numbers(len(paper.THETA_INIT)),
        "The controller's parameters at the start.",
    )
    steps: int = option(paper.STEPS, Whole(1, MOST_STEPS), "Of an episode.")
    start: tuple[float, ...] = option(paper.START, WITHIN, "Where an episode begins.")
    target: tuple[float, ...] = option(paper.TARGET, WITHIN, "Where the robot is to go.")
    horizon: int = option(paper.HORIZON, Whole(1, MOST_STAGES), "N, the inputs of a plan.")
    solver: str = option("riccati", OneOf(solvers.SOLVERS), "What solves Eq. (2).")
    tolerance: float = option(
        solvers.TOLERANCE,
        Number.within(solvers.LEAST_TOLERANCE, solvers.LARGEST_TOLERANCE),
        "Of the solver.",
    )
    evaluate_every: int = option(
        10, Whole(1, MOST_EPISODES), "Episodes between rollouts without noise."
    )

    def __post_init__(self) -> None:
        for one in fields(self):
            value = one.metadata["allowed"].check(one.name, getattr(self, one.name))
            object.__setattr__(self, one.name, value)
        if self.box == "printed" and any(np.greater(self.start, paper.PRINTED_UPPER)):
            raise ParameterError(
                f"start = {self.start} lies outside the box as printed, box = 'printed'"
            )
        if self.values_actions and not self.clipped:
            raise ParameterError(
                f"clipped = False leaves actions that {self.learner} with constrained ="
                f" {self.constrained} cannot value: they are outside the OCP's bounds"
            )

    @property
    def task(self) -> Task:
        """Where the robot starts, where it is to go, and what it avoids."""
        return paper.task(self.layout, box=self.box, start=self.start, target=self.target)

    @property
    def values_actions(self) -> bool:
        """Whether Q(s, a) proper is learned, with u_0 = a fixed, and not V(s)."""
        return self.constrained or LEARNERS[self.learner].valued

    @property
    def canonical(self) -> "Experiment":
        """The same run, with the default in every field that its learner does not read."""
        unread: dict[str, Any] = {one.name: one.default for one in fields(self) if self._skips(one)}
        said = {name: default for name, default in unread.items() if getattr(self, name) != default}
        return replace(self, **said) if said else self

    def _skips(self, one: "Field[Any]") -> bool:
        return one.metadata["optional"] and one.name not in LEARNERS[self.learner].reads

    def __str__(self) -> str:
        place = f"layout {short_name(self.layout)}"
        return f"{self.learner} in {place}, decay per {self.decay}, seed {self.seed}"


def frozen_arm(experiment: Experiment) -> Experiment:
    """The control arm of a run: the same noise and the same controller, and theta never moves."""
    return replace(experiment, learner="frozen", constrained=False).canonical
