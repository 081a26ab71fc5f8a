"""Does the network need theta? Two networks fitted to the same examples, tested on others."""

from dataclasses import dataclass

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis import metrics
from nmpcrl.learning.network import QNetwork
from nmpcrl.study import paper
from nmpcrl.study.records import Records

HELD_OUT = 5  # every fifth episode is for testing
FITS = 4000  # mini-batches of each network


@dataclass(frozen=True, eq=False)
class Imitation:
    """The predictions of two networks in the held-out steps of one run."""

    episode: Vector  # of each held-out step
    value: Vector  # V_theta(s), the exact value
    without_theta: Vector  # prediction from (s, a), as in DES
    with_theta: Vector  # prediction from (s, a, theta), as in RDES

    def error(self, which: str) -> float:
        """Root mean square error of `with_theta` or `without_theta`, in units of cost."""
        return metrics.root_mean_square(getattr(self, which) - self.value)

    @property
    def ratio(self) -> float:
        """Error with theta over error without; theta helps if the ratio is below 1."""
        return self.error("with_theta") / self.error("without_theta")


def imitate(records: Records, *, fits: int = FITS) -> Imitation:
    """Fit the networks of DES and RDES to one run, and predict its held-out episodes with both."""
    steps = records.steps
    solved = np.isfinite(steps["value"])
    state_action = np.hstack([steps["state"], steps["action"]])[solved]
    before = metrics.theta_before(records)[solved]
    value, episode = steps["value"][solved], steps["episode"][solved]
    held_out = episode % HELD_OUT == HELD_OUT - 1
    if not held_out.any():
        held_out = episode == episode.max()  # fewer than five episodes: the last one

    def predict(inputs: Vector) -> Vector:
        rng = np.random.default_rng(0)
        network = QNetwork(inputs.shape[1], rng, learning_rate=paper.ZETA, batch=paper.BATCH)
        for example, target in zip(inputs[~held_out], value[~held_out], strict=True):
            network.remember(example, target)
        for _ in range(fits):
            network.fit()
        return network.predict(inputs[held_out])

    return Imitation(
        episode=episode[held_out],
        value=value[held_out],
        without_theta=predict(state_action),
        with_theta=predict(np.hstack([state_action, before])),
    )
