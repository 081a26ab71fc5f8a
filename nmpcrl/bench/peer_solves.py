"""Solves and learning steps of ours beside those of mpcrl: the same problem, in one process."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from mpcrl.optim import GradientDescent

from nmpcrl import Vector
from nmpcrl.bench import baseline_mpcrl
from nmpcrl.control import Nmpc
from nmpcrl.learning import Exploration, Weights, q_learning, train
from nmpcrl.learning.environment import StepFunction
from nmpcrl.study import paper
from nmpcrl.study.problems import gros_zanon as gz
from nmpcrl.study.problems import lqr
from nmpcrl.study.problems import peers as csnlp

SOLVES = 60  # of each, after some that do not count
FIRST = 5
EPISODES, EPISODE = 3, 100  # how many count, and learning steps of each
TIGHT = "ipopt, 1e-10"


@dataclass(frozen=True, eq=False)
class Peers:
    """A problem twice: ours, and as mpcrl's agent has it. Both learn Q by semi-gradients."""

    name: str
    nmpc: Nmpc
    theta: Vector
    start: Vector
    plant: StepFunction
    agent: Any
    world: Callable[[int], Any]  # so many steps of the plant, for the agent
    rate: float  # alpha
    noise: float = 0.0  # deviation of what is added to the action


@dataclass(frozen=True)
class Pair:
    """Mean times of the processor [s]."""

    ours: float
    theirs: float

    @property
    def ratio(self) -> float:
        """How many times as long theirs takes."""
        return self.theirs / self.ours


def gros_zanon(solver: str = "riccati") -> Peers:
    """The example of Gros and Zanon."""
    problem, rate = gz.problem(), 1e-4
    agent = csnlp.agent(csnlp.gros_zanon_plan(TIGHT), problem, GradientDescent(rate))
    ours = (Nmpc(problem, solver=solver), problem.theta, gz.START, gz.plant)
    world = partial(csnlp.world, problem, gz.plant, gz.START)
    return Peers("Gros and Zanon", *ours, agent, world, rate)


def linear(solver: str = "riccati") -> Peers:
    """The linear plant with a quadratic cost, whose truth is known."""
    problem, rate = lqr.problem(), 3e-5
    agent = csnlp.agent(csnlp.lqr_plan(TIGHT), problem, GradientDescent(rate))
    world = partial(csnlp.world, problem, lqr.plant, lqr.START)
    ours = (Nmpc(problem, solver=solver), problem.theta, lqr.START, lqr.plant)
    return Peers("linear-quadratic", *ours, agent, world, rate)


def robot(solver: str = "riccati") -> Peers:
    """The paper's robot among four obstacles."""
    nmpc = paper.nmpc(solver=solver)

    def plant(state: Vector, action: Vector, _: Any) -> tuple[Vector, float, bool]:
        return nmpc.plant.step(state, action), nmpc.task.stage_cost(state, action), False

    ours = (nmpc, np.array(paper.THETA_INIT), np.array(paper.START), plant)

    def world(steps: int) -> baseline_mpcrl.World:
        return baseline_mpcrl.World(nmpc, steps - 1)  # it is cut off one call later

    return Peers(
        "the paper's robot", *ours, baseline_mpcrl.agent(nmpc), world, paper.ALPHA, paper.NOISE
    )


PROBLEMS: tuple[Callable[..., Peers], ...] = (robot, gros_zanon, linear)


def side_by_side(peers: Peers) -> Pair:
    """V of the states of one closed loop, each solved by both in turns, from their last plans."""
    rng, state, theta = np.random.default_rng(0), peers.start, peers.theta
    plan, spent = peers.nmpc.solve(state, theta), []
    with csnlp.silent():
        for _ in range(FIRST + SOLVES):
            plan, ours = timed(partial(peers.nmpc.solve, state, theta, plan))
            _, theirs = timed(partial(peers.agent.state_value, state, True))
            spent.append((ours, theirs))
            state, _, _ = peers.plant(state, plan.action, rng)
    return Pair(*np.mean(spent[FIRST:], axis=0).tolist())


def learning(peers: Peers) -> Pair:
    """A step of Q-learning, an episode of each in turns.

    Both solve for V(s), Q(s, a) and the next value and move theta; mpcrl acts with what it planned
    for the next value, and ours plans anew.
    """
    spent = []
    with csnlp.silent():
        for episode in range(1 + EPISODES):
            _, ours = timed(partial(list, _steps(peers, episode)))
            world = peers.world(EPISODE)
            _, theirs = timed(partial(peers.agent.train, world, episodes=1, seed=episode))
            spent.append((ours / EPISODE, theirs / EPISODE))
    return Pair(*np.mean(spent[1:], axis=0).tolist())


def _steps(peers: Peers, seed: int) -> Iterator[Any]:
    """Those of an episode of ours."""
    nmpc, theta = peers.nmpc, peers.theta
    noise = np.random.default_rng(seed).normal(size=(1, EPISODE, nmpc.m))
    return train(
        q_learning(nmpc, peers.rate),
        nmpc,
        Weights(theta, np.zeros(theta.size)),
        Exploration(peers.noise * noise, np.ones((1, EPISODE))),
        plant=peers.plant,
        start=peers.start,
        rng=seed,
    )


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """What a call returns, and the processor's time for it [s]."""
    began = time.process_time()
    result = call()
    return result, time.process_time() - began
