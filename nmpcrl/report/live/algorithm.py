"""What Algorithm 1 of `learning.js` is given and no reader moves."""

from typing import TypedDict

from nmpcrl.control.nmpc import ABSURD, FAR
from nmpcrl.learning.training import PATIENCE
from nmpcrl.study import paper


class Limits(TypedDict):
    """When a run is a divergence."""

    absurd: float  # the largest size of a component of theta or w
    far: float  # that of a state
    patience: int  # so many episodes in a row that a failed solve ended


class Network(TypedDict):
    """The sizes of the network that imitates the NMPC."""

    hidden: int  # neurons in each hidden layer
    batch: int  # examples of a fit


class Fixed(TypedDict):
    """Both, as a page's settings hold them."""

    limits: Limits
    network: Network


def fixed() -> Fixed:
    """The library's own numbers."""
    return {
        "limits": {"absurd": ABSURD, "far": FAR, "patience": PATIENCE},
        "network": {"hidden": paper.HIDDEN, "batch": paper.BATCH},
    }
