"""An example is something to see in a page, with the settings that show it; two are made here."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.learning.rollout import Rollout, evaluate
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.setup import controller_of

SETTINGS = (
    "learner", "alpha", "beta", "beta_tdc", "zeta", "decay", "decay_rate", "horizon", "seed",
    "episodes", "start", "target", "theta",
)  # fmt: skip
BESIDE = 1e-5  # of theta_c, to either side of a kink
ASIDE = 0.01  # of a start, to either side of a tie [m]


@dataclass(frozen=True)
class Example:
    """Something to see."""

    title: str
    sentence: str  # what to see
    numbers: dict[str, float]  # of the sentence, not rounded
    experiment: Experiment  # the run, which a page trains
    look: str = ""  # where on the page to look
    against: Experiment | None = None  # a run to lay over it, which the page trains, too
    learned: bool = True  # whether it is about what was learned, or about the theta it begins with

    @property
    def settings(self) -> dict[str, Any]:
        """Those of the run, as `settings_of` has them."""
        return settings_of(self.experiment)


def settings_of(experiment: Experiment) -> dict[str, Any]:
    """`SETTINGS` and the centres of the layout as a page opens them, in the types of JSON."""
    values = {name: getattr(experiment, name) for name in SETTINGS}
    plain = {name: list(v) if isinstance(v, tuple) else v for name, v in values.items()}
    return plain | {"layout": [list(one) for one in paper.centres_of(experiment.layout)]}


def example(
    title: str, sentence: str, numbers: dict[str, float], experiment: Experiment, **more: Any
) -> Example:
    """An example whose `sentence` is filled with the `numbers` and the `learner`.

    Args:
        title, sentence, numbers, experiment, more: fields of `Example`.
    """
    said = sentence.format(learner=experiment.learner, **numbers)
    return Example(title, said, numbers, experiment, **more)


def kink() -> Example:
    """A start exactly on an obstacle's boundary, Xi + theta_c = 0."""
    theta = (*paper.THETA_INIT[:-1], 0.0)
    experiment = Experiment(layout=((0.0, 1.25),), start=(0.0, 0.0, 0.0), theta=theta)
    below, above = (_slope(experiment, side * BESIDE) for side in (-1, 1))
    sentence = (
        "The robot starts exactly on the boundary of an obstacle, and the value has a kink there:"
        " its slope in {{c}} is {below:.1f} where {{c}} is a little below 0, and {above:.1f} where"
        " it is a little above, {jump:.0f} more."
    )
    numbers = {"below": below, "above": above, "jump": above - below}
    look = (
        "Look at the slope in the line of results, and move the robot with the arrow keys towards"
        " the obstacle and away from it."
    )
    return example("A kink", sentence, numbers, experiment, look=look, learned=False)


def tie() -> Example:
    """An obstacle between start and target, around which both ways have the same cost."""
    experiment = Experiment(
        layout=((3.0, 3.0),), start=(1.0, 3.0, 0.0), target=(6.0, 3.0, 0.0), horizon=20
    )
    x, y, heading = experiment.start
    beside = (replace(experiment, start=(x, y + side, heading)) for side in (-ASIDE, ASIDE))
    one, other = map(first_rollout, beside)
    sentence = (
        "The obstacle stands in the middle of the way. Move the robot {aside:.2f} m to either side,"
        " and it passes on that side, at a cost of {one:.0f}. Exactly between, the two plans are"
        " equal, and between them is one that stops before the obstacle: no small step improves it,"
        " but a step aside lowers the cost to second order. The solver looks at the curvature,"
        " begins again, and passes at a cost of {between:.0f}."
    )
    start, theta = np.array(experiment.start), np.array(experiment.theta)
    numbers = {
        "aside": ASIDE,
        "one": one.cost,
        "other": other.cost,
        "between": first_rollout(experiment).cost,
        "restarts": controller_of(experiment).solve(start, theta).restarts,
        "apart": float(np.abs(one.states[:, 1] - other.states[:, 1]).max()),
    }
    return example(
        "A tie",
        sentence,
        numbers,
        experiment,
        look="Look at the two robots: both pass, and the one that starts aside at a lower cost.",
        against=replace(experiment, start=(x, y + ASIDE, heading)),
        learned=False,
    )


def first_rollout(experiment: Experiment) -> Rollout:
    """Without noise, with the theta that a run begins with."""
    theta: Vector = np.array(experiment.theta)
    return evaluate(controller_of(experiment), theta, experiment.steps)


def _slope(experiment: Experiment, by: float) -> float:
    """dV/dtheta_c in the start, a little beside theta."""
    theta = np.array(experiment.theta)
    theta[-1] += by
    nmpc = controller_of(experiment)
    return float(nmpc.solve(nmpc.task.start, theta).features[-1])
