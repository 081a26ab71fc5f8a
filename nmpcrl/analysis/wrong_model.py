"""Learners on the example of Gros and Zanon (2020), beside what is possible there.

Each arm meets the same disturbance and the same noise of a seed. Step sizes were chosen with
three seeds that are not among those judged, from three to six values each; that of
"LSTD-Q, every step" is the one of mpcrl's example. What is said of the judged seeds was written
down in `PREDICTIONS` before they were run.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc, SolverError
from nmpcrl.learning import (
    Diverged,
    Exploration,
    Learner,
    Weights,
    expected_sarsa,
    frozen,
    gradient_tdc,
    lstd_q,
    policy_gradient,
    q_learning,
    train,
)
from nmpcrl.study.problems import gros_zanon as gz

STEPS, WINDOW = 1000, 50  # of a run, and those whose costs are averaged
DEVIATION = 0.05  # of the normal noise that is added to the action
SEEDS = 50
EPISODES, EPISODE = 20, 100  # of a test: no noise on the action
TEST_SEED = 10**6  # its disturbances, the same for all


ARMS: Mapping[str, Callable[[Nmpc], Learner]] = MappingProxyType(
    {
        "frozen": frozen,
        "LSTD-Q, every step": lambda nmpc: lstd_q(nmpc, 0.05, every=1),
        "LSTD-Q, batches of 20": lambda nmpc: lstd_q(nmpc, 0.02, every=20),
        "QL": lambda nmpc: q_learning(nmpc, 1e-4),
        "ES": lambda nmpc: expected_sarsa(nmpc, 1e-4),
        "TDC": lambda nmpc: gradient_tdc(nmpc, 1e-4, 1e-4),
        "DPG": lambda nmpc: policy_gradient(nmpc, 1e-3, every=100),
    }
)
PREDICTIONS: Mapping[str, str] = MappingProxyType(  # of the judged seeds; `held` decides
    {
        "informed": "In at least 45 of 50 seeds QL, ES and DPG each end below the plan that begins"
        " with the plant's A, B and mean disturbance.",
        "every step": "The median of LSTD-Q at every step ends above that of QL.",
        "optimum": "No arm's median ends within 20 % of the best policy.",
        "alike": "The medians of QL and ES differ by less than 30 %.",
        "stable": "At least 48 of 50 seeds of QL, ES, TDC and DPG end with a finite cost.",
    }
)


@dataclass(frozen=True)
class Course:
    """How a run went; a run that diverged ends in infinite costs."""

    arm: str
    seed: int
    costs: tuple[float, ...]  # mean over each window of training
    test: float  # mean cost of a step without noise on the action, with the last theta
    theta: tuple[float, ...]


@cache
def controller() -> Nmpc:
    """The plan that learns."""
    return Nmpc(gz.problem())


def run(arm: str, seed: int, steps: int = STEPS) -> Course:
    """Train an arm for one episode, and test what it ends with."""
    nmpc, problem = controller(), gz.problem()
    disturbance, noise = (np.random.default_rng([k, seed]) for k in (0, 1))
    explore = Exploration(
        DEVIATION * noise.normal(size=(1, steps, 1)), np.ones((1, steps)),
    )  # fmt: skip
    costs, theta = np.full(steps, np.inf), problem.theta
    weights = Weights(theta, np.zeros(theta.size))
    world: dict[str, Any] = {"plant": gz.plant, "start": gz.START, "rng": disturbance}
    try:
        for step in train(ARMS[arm](nmpc), nmpc, weights, explore, **world):
            costs[step.time], theta = step.cost, step.weights.theta
        result = judge(theta)
    except Diverged:
        result = np.inf
    windows = np.nan_to_num(costs, nan=np.inf).reshape(-1, min(WINDOW, steps)).mean(axis=1)
    return Course(arm, seed, tuple(windows.tolist()), result, tuple(theta.tolist()))


def judge(theta: Vector, episodes: int = EPISODES, seed: int = TEST_SEED) -> float:
    """Mean cost of a step of the plan's policy; infinite where a solve failed."""
    plan = None

    def act(state: Vector) -> Vector:
        nonlocal plan
        plan = controller().solve(state, theta, plan)
        return plan.action

    try:
        return mean_cost(act, episodes, seed)
    except (SolverError, ValueError):
        return np.inf


def mean_cost(
    act: Callable[[Vector], Vector], episodes: int = EPISODES, seed: int = TEST_SEED
) -> float:
    """Mean cost of a step of any policy, over episodes of `EPISODE` steps from the start."""
    rng, total = np.random.default_rng(seed), 0.0
    for _ in range(episodes):
        state = gz.START
        for _ in range(EPISODE):
            state, cost, _ = gz.plant(state, act(state), rng)
            total += cost
    return total / (episodes * EPISODE)


def held(tests: Mapping[str, Vector], informed: float, best: float) -> dict[str, bool]:
    """Which of `PREDICTIONS` came true.

    Args:
        tests: the last cost of each seed, by arm.
        informed: cost of the informed plan.
        best: cost of the best policy.
    """
    middle = {arm: float(np.median(costs)) for arm, costs in tests.items()}
    seeds = len(tests["QL"])
    learned = [one for arm, one in middle.items() if arm != "frozen"]
    return {
        "informed": all(
            (tests[arm] < informed).sum() >= 0.9 * seeds for arm in ("QL", "ES", "DPG")
        ),
        "every step": middle["LSTD-Q, every step"] > middle["QL"],
        "optimum": min(learned) > 1.2 * best,
        "alike": abs(middle["QL"] / middle["ES"] - 1) < 0.3,
        "stable": all(
            np.isfinite(tests[arm]).sum() >= 0.96 * seeds for arm in ("QL", "ES", "TDC", "DPG")
        ),
    }
