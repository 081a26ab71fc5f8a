"""The robot in the loop, where it is not the one that the controller predicts with.

The plan keeps Eq. (18); what is charged is Eq. (20) in any case. An actuator that lags would need a
state that the controller does not see: a `Trial` takes that, and any other plant.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

from nmpcrl.control import Plant, differential_drive, unicycle

GRIP = 0.85  # of the speed that a slipping robot keeps
DRIFT = 0.05  # [m/s] at which a current takes a robot along y


def slipping(state: Any, action: Any) -> Any:
    """Some of the speed is lost, none of the turn rate."""
    moved: Any = (GRIP * action[0], action[1])
    return unicycle(state, moved)


def drifting(state: Any, action: Any) -> Any:
    """A current, whatever the robot does."""
    return unicycle(state, action) + [0.0, DRIFT, 0.0]


PLANTS: dict[str, Callable[..., Any] | None] = {  # dynamics
    "model": None,  # what the controller predicts with
    "slipping": slipping,
    "drifting": drifting,
}


@cache
def plant_of(name: str) -> Plant | None:
    """The plant of a name in `PLANTS`; None for the one that plans."""
    dynamics, robot = PLANTS[name], differential_drive()
    if dynamics is None:
        return None
    names = (robot.state_names, robot.action_names)
    return Plant(dynamics, *names, robot.lower, robot.upper, period=robot.period)
