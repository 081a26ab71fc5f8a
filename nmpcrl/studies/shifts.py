"""Runs where the layout changes between episodes.

A controller plans with the centres of the obstacles that it knows. "told": the new ones from the
change on. "cost" and "delta": the old ones until a chart fires on the summed cost or the mean
|delta| of an episode, and from the next episode on the true ones. "never": the first ones for good.
A learner reacts to what its controller knows, and so to false alarms, too.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from statistics import fmean
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Vector
from nmpcrl.analysis.encounters import judged
from nmpcrl.analysis.suite import entry, judge
from nmpcrl.control import Nmpc
from nmpcrl.learning import Diverged, Exploration, Learner, Weights, expected_sarsa, train
from nmpcrl.learning.network import QNetwork, machine_code
from nmpcrl.learning.training import absurd
from nmpcrl.studies.investigation import Row
from nmpcrl.studies.worlds_run import THETA, controller, exploration, row
from nmpcrl.study import Experiment, paper
from nmpcrl.study.drawn import JUDGE
from nmpcrl.study.learners import LEARNERS, Generators
from nmpcrl.study.moving import Motion, World, still

EVERY = 5  # episodes between two rollouts
WINDOW = 20  # episodes that a chart looks back to
LIMIT = 4.0  # standard deviations at which it fires
RAISED, FOR = 10.0, 20  # times alpha after a change, and for how many episodes
AGE = 10 * 130.0  # examples, ten episodes: the decay of the weights in recent replay


def sequence(rate: str, place: str, episodes: int) -> tuple[list[str], list[int]]:
    """The layouts of a sequence, and the number of the layout of each episode, from 0."""
    rng, e = np.random.default_rng([25, int(place[1:])]), np.arange(episodes)
    names = rng.permutation([*JUDGE]).tolist()
    changes = {
        "once": e == episodes // 2,
        "every 50": e % 50 == 0,
        "random": rng.random(episodes) < 1 / 50,
    }
    order = np.cumsum(changes[rate] & (e > 0)).tolist()
    return names[: order[-1] + 1], order


def fires(values: Sequence[float]) -> bool:
    """Whether Shewhart's chart fires on the last value: |x - mean| > LIMIT s, or x is nan.

    Mean and standard deviation s are over the `WINDOW` values before. Independent normal values
    fire falsely with a probability of 0.001.
    """
    *before, value = values[-WINDOW - 1 :]
    if len(before) < WINDOW:
        return False
    return not abs(value - np.mean(before)) <= LIMIT * np.std(before, ddof=1)


class Recent(QNetwork):
    """A network in the weights and examples of another, fitted to late examples most often.

    A mini-batch is drawn without replacement, with weights exp(-age / `AGE`), by the largest of
    Gumbel's keys.
    """

    def __init__(self, network: QNetwork, rng: np.random.Generator) -> None:
        self.net, self._rng = network.net, rng

    def draw(self) -> NDArray[np.intp]:
        """The numbers of the examples of a mini-batch; the last is the latest."""
        first = max(len(self) - int(8 * AGE), 0)  # weights below exp(-8) count as 0
        ages = np.arange(len(self) - first)[::-1]
        keys = self._rng.gumbel(size=ages.size) - ages / AGE
        return first + np.argpartition(keys, -paper.BATCH)[-paper.BATCH :]

    def fit(self) -> float:
        """One Adam step on a mini-batch of `draw`; its loss before the step."""
        weights, examples, _, counts, *rest = self.net
        order, batch = np.arange(paper.BATCH, dtype=np.int32), np.array([paper.BATCH, counts[1]])
        drawn = (weights, examples[self.draw()], order, batch, *rest)
        loss = float(machine_code().fit(drawn))
        counts[1] = batch[1]
        return loss


def changing(
    nmpc: Nmpc,
    layouts: Sequence[Sequence[Motion]],
    order: Sequence[int],
    learner: Learner,
    explore: Exploration,
    *,
    knows: str,
    reset: bool = False,
    raised: Learner | None = None,
) -> Iterator[tuple[World, bool, Vector]]:
    """Algorithm 1 from theta_init: after each episode its world, whether a chart fires, and theta.

    `order` has the number of the layout of each episode; `knows` is "told", "cost", "delta" or
    "never". With `reset` theta begins anew after a change; `raised` is the learner in the `FOR`
    episodes after a change, if it is another.
    """
    world_of = cache(lambda true, seen: World(layouts[true], seen=layouts[seen]))
    first = Weights(THETA, np.full(THETA.size, paper.W_INIT))
    weights, seen, changed, alarm, watched = first, order[0], -FOR, False, list[float]()
    for e, layout in enumerate(order):
        if alarm or (knows == "told" and layout != seen):
            seen, changed = layout if knows == "told" else order[e - 1], e
            weights, watched = first if reset else weights, []
        moves = raised if raised and e - changed < FOR else learner
        noise = Exploration(explore.noise[e : e + 1], explore.scale[e : e + 1])
        world, costs, deltas = world_of(layout, seen), [0.0], [0.0]
        with suppress(Diverged):  # the last usable theta stays, and is judged
            for step in train(moves, nmpc, weights, noise, **world.environment):
                weights = weights if absurd(step.weights) else step.weights
                costs.append(step.cost)
                deltas.append(abs((step.update and step.update.delta) or 0.0))
        watched.append(sum(costs) if knows == "cost" else fmean(deltas))
        alarm = knows in ("cost", "delta") and fires(watched)
        yield world, alarm, weights.theta


def shifting(rate: str, setting: tuple[str, ...], place: str, episodes: int, seed: int) -> Row:
    """A learner where the layout changes; costs are shares of theta_init's in the same layout.

    A remedy begins anew in the last layout of the sequence, with the remaining episodes.
    """
    names, order = sequence(rate, place, episodes)
    if setting[0] == "remedy":
        alone = judge(entry(setting[1]), names[-1], seed, order.count(order[-1]))
        return row(alone.cost / alone.initial, arrived=alone.arrived)
    kind, knows, reaction = setting
    nmpc, layouts = controller(), [still(JUDGE[name]) for name in names]
    initial = [judged(nmpc, THETA, World(each)).cost for each in layouts]
    rng = np.random.default_rng([seed, 3])
    learner = LEARNERS[kind].make(Experiment(), nmpc, Generators(rng, rng, rng))
    if reaction == "recent":
        imitation: Any = learner.bootstrap
        late = Recent(imitation.network, rng)
        learner = replace(learner, bootstrap=replace(imitation, network=late))
    raised = expected_sarsa(nmpc, RAISED * paper.ALPHA) if reaction == "raised" else None
    series, events, arrived = [], [], False
    followed = changing(nmpc, layouts, order, learner, exploration(episodes, seed),
                        knows=knows, reset=reaction == "reset", raised=raised)  # fmt: skip
    for e, (world, alarm, theta) in enumerate(followed):
        events += [e] if alarm else []
        if e % EVERY == EVERY - 1 or e == episodes - 1:
            made = judged(nmpc, theta, world)
            series.append(made.cost / initial[order[e]])
            arrived = made.arrived
    return row(series[-1], arrived=arrived, series=series, events=events)
