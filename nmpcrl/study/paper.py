"""Every number of the paper: Table I and the task. Where it is silent or contradicts itself, see
`DEPARTURES`."""

import numpy as np

from nmpcrl.control import Nmpc, Obstacle, Task, differential_drive
from nmpcrl.study.departures import DEPARTURES

__all__ = ["DEPARTURES", "LAYOUTS", "nmpc", "task"]

ALPHA = 1e-7  # step size of theta
BETA = 1e-8  # step size of w  # departure J
ZETA = 1e-2  # learning rate of the network
GAMMA = 0.97
W_INIT = 1e-4  # every component of w
THETA_INIT = (1.0, 1.0, 0.05, 0.05, 0.05, 1.0, 1.0, 0.1, 0.001)
THETA_NAMES = ("x", "y", "heading", "v", "nu", "x_f", "y_f", "heading_f", "c")
HORIZON = 10  # N
STEPS = 130  # an episode runs over t = 0, ..., K with K = 129
EPISODES = 300
SLACK_WEIGHT = 100.0  # omega
BATCH = 128
NOISE = 1.0  # standard deviation of epsilon: Table I gives it as the law of rho  # departure D
DECAY_RATE = 0.99  # c_epsilon, which is not given  # departure C

START = (-2.5, 1.5, 0.0)  # x [m], y [m], heading [rad]
TARGET = (8.5, 2.0, np.pi / 2)
LOWER = (-3.0, -3.0, -np.inf)  # printed as [-9, 3]^2, which excludes the target  # departure A
UPPER = (9.0, 9.0, np.inf)

LAYOUTS = {  # centres of the four obstacles [m]; the paper shows none  # departure B
    "A": ((0.5, 2.2), (3.0, 0.5), (5.5, 2.8), (7.0, 0.3)),
}


def task(layout: str = "A") -> Task:
    """The robot's task among the four obstacles of a named layout."""
    if layout not in LAYOUTS:
        raise ValueError(f"layout = {layout!r} must be one of {', '.join(LAYOUTS)}")
    return Task(
        start=np.array(START),
        target=np.array(TARGET),
        lower=np.array(LOWER),
        upper=np.array(UPPER),
        obstacles=tuple(Obstacle(x, y) for x, y in LAYOUTS[layout]),
    )


def nmpc(layout: str = "A", *, horizon: int = HORIZON, solver: str = "riccati") -> Nmpc:
    """The paper's controller, Eq. (2) with Table I, among the obstacles of a named layout."""
    return Nmpc(
        plant=differential_drive(),
        task=task(layout),
        horizon=horizon,
        gamma=GAMMA,
        slack_weight=SLACK_WEIGHT,
        solver=solver,
    )
