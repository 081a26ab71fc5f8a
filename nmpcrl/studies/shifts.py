"""A layout that changes between episodes: when, who notices, and what a learner does about it.

What a controller knows is where it plans the obstacles to be. "told": the new centres from the
change on. "cost" and "delta": the old ones until a chart fires on the summed cost or the mean
|delta| of an episode, and from the next episode on the true ones. "never": the first ones for good.
A learner reacts to what its controller knows, and so to false alarms, too.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from statistics import fmean
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.learning import Diverged, Exploration, Learner, Weights, train
from nmpcrl.learning.rollout import Persistent
from nmpcrl.learning.training import absurd
from nmpcrl.study import paper
from nmpcrl.study.geometry import Centres
from nmpcrl.study.moving import World, still

WINDOW = 20  # episodes that a chart looks back to
LIMIT = 4.0  # standard deviations at which it fires
RATES: dict[str, Callable[[int, np.random.Generator], Any]] = {  # which episodes bring a change
    "once": lambda episodes, _: np.arange(episodes) == episodes // 2,
    "every 50": lambda episodes, _: (np.arange(episodes) % 50 == 0) & (np.arange(episodes) > 0),
    "random": lambda episodes, rng: (rng.random(episodes) < 1 / 50) & (np.arange(episodes) > 0),
}
RAISED, FOR = 10.0, 20  # times alpha after a change, and for how many episodes


def schedule(rate: str, episodes: int, rng: np.random.Generator) -> list[int]:
    """The number of the layout of each episode, from 0."""
    found: list[int] = np.cumsum(RATES[rate](episodes, rng)).tolist()
    return found


@dataclass
class Chart:
    """Shewhart's chart of individual values: fires at a value far from the `WINDOW` before.

    It fires if |x - mean| > LIMIT s, s the standard deviation of those, and then begins anew.
    On independent normal values it does so falsely with the probability that a t of WINDOW - 1
    degrees of freedom exceeds LIMIT / sqrt(1 + 1 / WINDOW): 0.001 an episode.
    """

    values: list[float] = field(default_factory=list)

    def __call__(self, value: float) -> bool:
        """Whether it fires on the next value."""
        before = self.values[-WINDOW:]
        self.values.append(value)
        if len(before) < WINDOW:
            return False
        fires = not abs(value - np.mean(before)) <= LIMIT * np.std(before, ddof=1)
        if fires:
            self.values.clear()
        return bool(fires)


class Recent(np.random.Generator):
    """A generator for replay that draws late examples most often.

    Without replacement, with weights exp(-age / `AGE`), by the largest of Gumbel's keys.
    """

    AGE = 10 * 130.0  # examples: ten episodes

    def choice(self, a: Any, size: Any = None, *args: Any, **options: Any) -> Any:
        """Numbers of examples, of which there are `a`; the last is the latest."""
        first = max(int(a) - int(8 * self.AGE), 0)  # weights below exp(-8) are nothing
        ages = np.arange(int(a) - first)[::-1]
        keys = self.gumbel(size=ages.size) - ages / self.AGE
        return first + np.argpartition(keys, -size)[-size:]


@dataclass(frozen=True, eq=False)
class Episode:
    """The end of one episode of a changing world."""

    layout: int  # the number of the true one
    seen: int  # that of the one which the controller planned with
    alarm: bool  # whether its chart fired at the end
    theta: Vector


def changing(
    nmpc: Persistent,
    layouts: Sequence[Centres],
    order: Sequence[int],
    make: Callable[[float], Learner],
    explore: Exploration,
    *,
    knows: str = "told",
    reaction: str = "plain",
) -> Iterator[Episode]:
    """Algorithm 1 from theta_init, where episode e is in `layouts[order[e]]`, by episodes.

    Args:
        nmpc: acts, and is what is learned.
        layouts: in which it happens.
        order: of `schedule`.
        make: (factor of alpha) -> learner; called at most once for each factor.
        explore: the noise, of as many episodes.
        knows: "told", "cost", "delta" or "never".
        reaction: "plain", "raised" or "reset", to what is known.
    """
    make, world_of = cache(make), cache(partial(_world, layouts))
    first = Weights(np.array(paper.THETA_INIT), np.full(len(paper.THETA_INIT), paper.W_INIT))
    weights, seen, changed, chart = first, order[0], -FOR, Chart()
    for e, layout in enumerate(order):
        if knows == "told" and layout != seen:
            seen, changed = layout, e
            weights = first if reaction == "reset" else weights
        raised = reaction == "raised" and e - changed < FOR
        one = Exploration(explore.noise[e : e + 1], explore.scale[e : e + 1])
        world, costs, deltas = world_of(layout, seen), [0.0], [0.0]
        try:
            learner = make(RAISED if raised else 1.0)
            for step in train(learner, nmpc, weights, one, **world.environment):
                weights = weights if absurd(step.weights) else step.weights
                costs.append(step.cost)
                deltas.append(abs((step.update and step.update.delta) or 0.0))
        except Diverged:
            pass  # the last usable theta stays, and is judged
        alarm = knows in STATISTICS and chart(
            STATISTICS[knows](costs if knows == "cost" else deltas)
        )
        yield Episode(layout, seen, alarm, weights.theta)
        if alarm:
            seen, changed = layout, e + 1
            weights = first if reaction == "reset" else weights


STATISTICS: dict[str, Callable[[list[float]], float]] = {"cost": sum, "delta": fmean}


def _world(layouts: Sequence[Centres], true: int, seen: int) -> World:
    return World(still(layouts[true]), seen=still(layouts[seen]))
