"""An `Experiment` is a frozen value that names one run."""

from dataclasses import Field, dataclass, field, fields, replace
from typing import Any

from nmpcrl.control import solvers
from nmpcrl.study import paper
from nmpcrl.study.parameters import (
    ParameterError,
    number,
    one_of,
    parameter_vector,
    true_or_false,
    whole,
)
from nmpcrl.study.setup import DECAYS, LEARNERS, NETWORKS

PAPER = ("ES", "DES", "RDES", "GES")  # the paper's learners
MAIN = (*PAPER, "TDC", "frozen")  # of the main table
NETWORK_LEARNERS = ("DES", "RDES")
MOVING = tuple(name for name in LEARNERS if name != "frozen")  # whose theta moves


def read_by(learners: tuple[str, ...], default: Any) -> Any:
    """A field that only these learners read; to the others it is nothing, and no part of a key."""
    return field(default=default, metadata={"read_by": learners})


@dataclass(frozen=True)
class Experiment:
    """One run; the defaults are the paper's.

    Raises:
        ParameterError: a field is not what it may be.
    """

    learner: str = "ES"
    seed: int = 0
    episodes: int = paper.EPISODES
    layout: str = "A"
    decay: str = "step"  # what k of Eq. (5) counts: "step" or "episode"  # departure C
    decay_rate: float = paper.DECAY_RATE  # c_epsilon
    alpha: float = read_by(MOVING, paper.ALPHA)
    beta: float = read_by(("GES", "matched"), paper.BETA)
    zeta: float = read_by(NETWORK_LEARNERS, paper.ZETA)
    gated: bool = read_by(NETWORK_LEARNERS, default=True)  # False: Algorithm 1 # departure G
    clipped: bool = True  # False: the noise may leave the action space  # departure E
    constrained: bool = read_by(  # True: Q(s, a), u_0 = a fixed, instead of V(s)  # departure F
        tuple(name for name in MOVING if name != "QL"), default=False
    )
    network: str = read_by(NETWORK_LEARNERS, "plain")  # departure H
    box: str = "hard"  # departures A and M
    ties_active: bool = read_by(MOVING, default=False)  # the other side of the kink # departure L
    curvature: bool = read_by(("TDC",), default=True)  # subtract h
    projected: bool = read_by(("TDC",), default=True)  # keep theta in `paper.THETA_SET`
    beta_tdc: float = read_by(("TDC",), paper.BETA_TDC)  # step size of w
    theta: tuple[float, ...] = paper.THETA_INIT
    steps: int = paper.STEPS  # of an episode
    horizon: int = paper.HORIZON
    solver: str = "riccati"
    tolerance: float = solvers.TOLERANCE  # of the solver
    evaluate_every: int = 10  # episodes between rollouts without noise

    def __post_init__(self) -> None:
        one_of(self, "learner", tuple(LEARNERS))
        one_of(self, "layout", tuple(paper.LAYOUTS))
        one_of(self, "decay", tuple(DECAYS))
        one_of(self, "solver", tuple(solvers.SOLVERS))
        one_of(self, "network", tuple(NETWORKS))
        one_of(self, "box", paper.BOXES)
        whole(self, "seed", least=0)
        for name in ("episodes", "steps", "horizon", "evaluate_every"):
            whole(self, name, least=1)
        for name in ("alpha", "beta", "beta_tdc", "zeta"):
            number(self, name, "a positive number", lambda value: value > 0)
        number(self, "decay_rate", "a number in (0, 1]", lambda value: 0 < value <= 1)
        least, largest = solvers.LEAST_TOLERANCE, solvers.LARGEST_TOLERANCE
        allowed = f"a number in [{least:g}, {largest:g}]"
        number(self, "tolerance", allowed, lambda value: least <= value <= largest)
        for name in ("gated", "clipped", "constrained", "ties_active", "curvature", "projected"):
            true_or_false(self, name)
        parameter_vector(self, "theta", len(paper.THETA_INIT))
        if self.values_actions and not self.clipped:
            raise ParameterError(
                f"clipped = False leaves actions that {self.learner} with constrained ="
                f" {self.constrained} cannot value: they are outside the OCP's bounds"
            )

    @property
    def values_actions(self) -> bool:
        """Whether Q(s, a) proper is learned, with u_0 = a fixed, and not V(s)."""
        return self.constrained or self.learner == "QL"

    @property
    def canonical(self) -> "Experiment":
        """The same run, with the default in every field that its learner does not read."""
        unread: dict[str, Any] = {one.name: one.default for one in fields(self) if self._skips(one)}
        return replace(self, **unread)

    def _skips(self, one: "Field[Any]") -> bool:
        return self.learner not in one.metadata.get("read_by", LEARNERS)

    def __str__(self) -> str:
        return f"{self.learner} in layout {self.layout}, decay per {self.decay}, seed {self.seed}"


def frozen_arm(experiment: Experiment) -> Experiment:
    """The control arm of a run: the same noise and the same controller, and theta never moves."""
    return replace(experiment, learner="frozen", constrained=False).canonical
