"""The numbers of the paper, Table I and the task; `DEPARTURES` has its gaps and contradictions."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from nmpcrl.control import Nmpc, Obstacle, Task, differential_drive
from nmpcrl.study import geometry
from nmpcrl.study.geometry import Centres
from nmpcrl.study.parameters import one_of

ALPHA = 1e-7  # step size of theta
BETA = 1e-8  # step size of w  # departure J
BETA_TDC = 1.5e-7  # ours, for exact TDC: above alpha; beta ||phi||^2 = 0.57 at theta_init
ZETA = 1e-2  # learning rate of the network
GAMMA = 0.97
W_INIT = 1e-4  # every component of w
THETA_INIT = (1.0, 1.0, 0.05, 0.05, 0.05, 1.0, 1.0, 0.1, 0.001)
THETA_SET = (0.0, 10.0)  # ours: TDC projects each component of theta into it
THETA_NAMES = ("x", "y", "heading", "v", "nu", "x_f", "y_f", "heading_f", "c")
HORIZON = 10  # N
STEPS = 130  # an episode runs over t = 0, ..., K with K = 129
EPISODES = 300
SLACK_WEIGHT = 100.0  # omega
BATCH = 128
HIDDEN = 64  # neurons in each of the two hidden layers
NOISE = 1.0  # standard deviation of epsilon: Table I gives it as the law of rho  # departure D
DECAY_RATE = 0.99  # c_epsilon, which is not given  # departure C

START = (-2.5, 1.5, 0.0)  # x [m], y [m], heading [rad]
TARGET = (8.5, 2.0, np.pi / 2)
LOWER = (-3.0, -3.0, -np.inf)  # departure A
UPPER = (9.0, 9.0, np.inf)
PRINTED_LOWER = (-9.0, -9.0, -np.inf)  # the box as printed excludes the target  # departure A
PRINTED_UPPER = (3.0, 3.0, np.inf)
BOXES = ("hard", "soft", "printed")  # departures A and M

LAYOUTS: dict[str, Centres] = {  # of the four obstacles [m]; the paper shows none  # departure B
    "A": ((0.5, 2.2), (3.0, 0.5), (5.5, 2.8), (7.0, 0.3)),
    # The others were drawn (`study.layouts`); the gaps of the last three close.
    "B": ((-0.3, 3.2), (2.9, 4.3), (3.2, 0.5), (6.9, 0.8)),
    "C": ((-1.1, 3.3), (0.9, 2.0), (2.5, 4.6), (4.0, -1.3)),
    "D": ((1.4, -0.3), (3.7, 2.4), (4.6, -0.2), (7.2, -1.0)),
    "E": ((0.6, 3.4), (2.6, 1.1), (4.3, 3.2), (7.3, -0.8)),
    "F": ((1.0, 3.2), (2.5, 1.1), (3.6, 4.3), (5.0, -0.5)),
}


def centres_of(layout: str | Centres) -> Centres:
    """The centres of a layout's obstacles [m]; the layout is a name in `LAYOUTS`, or centres."""
    return geometry.centres_of(layout, LAYOUTS)


def task(
    layout: str | Centres = "A",
    *,
    box: str = BOXES[0],
    start: Sequence[float] = START,
    target: Sequence[float] = TARGET,
) -> Task:
    """The robot's task among the obstacles of a layout, in one of `BOXES`."""
    printed = one_of(BOXES).check("box", box) == "printed"
    return Task(
        start=np.array(start),
        target=np.array(target),
        lower=np.array(PRINTED_LOWER if printed else LOWER),
        upper=np.array(PRINTED_UPPER if printed else UPPER),
        obstacles=tuple(Obstacle(x, y) for x, y in centres_of(layout)),
        soft_box=box == "soft",
        target_may_lie_outside=printed,
    )


def controller(task: Task, **options: Any) -> Nmpc:
    """The paper's controller, Eq. (2) with Table I, for any task; `options` are those of `Nmpc`."""
    weights = {"gamma": GAMMA, "slack_weight": SLACK_WEIGHT}
    return Nmpc(differential_drive(), task, **weights | options)


def nmpc(layout: str | Centres = "A", *, box: str = BOXES[0], **options: Any) -> Nmpc:
    """The paper's controller among the obstacles of a layout; `options` are those of `Nmpc`."""
    return controller(task(layout, box=box), **options)
