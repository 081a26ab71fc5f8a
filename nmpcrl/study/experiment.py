"""An `Experiment` is a frozen value that names one run; `run` carries it out."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from nmpcrl.learning import (
    Learner,
    QNetwork,
    Weights,
    deep_expected_sarsa,
    expected_sarsa,
    frozen,
    gradient_expected_sarsa,
    regularized_deep_expected_sarsa,
)
from nmpcrl.study import paper
from nmpcrl.study.parameters import number, one_of, parameter_vector, true_or_false, whole
from nmpcrl.study.records import Records, Table
from nmpcrl.study.training import (
    Diverged,
    Exploration,
    Persistent,
    Step,
    absurd,
    count_episodes,
    count_steps,
    evaluate,
    train,
)

LEARNERS = ("ES", "DES", "RDES", "GES", "frozen")
DECAYS = {"step": count_steps, "episode": count_episodes}
SOLVERS = ("fatrop", "ipopt")

SOLVED, RESTARTED, FAILED = range(3)  # the status column


@dataclass(frozen=True)
class Experiment:
    """One run; the defaults are the paper's.

    Raises:
        ParameterError: a field is not what it may be.
    """

    learner: str = "ES"
    seed: int = 0
    episodes: int = paper.EPISODES
    layout: str = "A"
    decay: str = "step"  # what k of Eq. (5) counts: "step" or "episode"  # departure C
    decay_rate: float = paper.DECAY_RATE  # c_epsilon
    alpha: float = paper.ALPHA
    beta: float = paper.BETA
    zeta: float = paper.ZETA
    gated: bool = True  # False: Algorithm 1 literally  # departure G
    theta: tuple[float, ...] = paper.THETA_INIT
    steps: int = paper.STEPS  # of an episode
    horizon: int = paper.HORIZON
    solver: str = "fatrop"
    evaluate_every: int = 10  # episodes between rollouts without noise

    def __post_init__(self) -> None:
        one_of(self, "learner", LEARNERS)
        one_of(self, "layout", tuple(paper.LAYOUTS))
        one_of(self, "decay", tuple(DECAYS))
        one_of(self, "solver", SOLVERS)
        whole(self, "seed", least=0)
        for name in ("episodes", "steps", "horizon", "evaluate_every"):
            whole(self, name, least=1)
        for name in ("alpha", "beta", "zeta"):
            number(self, name, "a positive number", lambda value: value > 0)
        number(self, "decay_rate", "a number in (0, 1]", lambda value: 0 < value <= 1)
        true_or_false(self, "gated")
        parameter_vector(self, "theta", len(paper.THETA_INIT))

    def __str__(self) -> str:
        return f"{self.learner} in layout {self.layout}, decay per {self.decay}, seed {self.seed}"


def run(experiment: Experiment, on_episode: Callable[[int, float], None] | None = None) -> Records:
    """Train and evaluate as `experiment` says; the same experiment gives the same numbers.

    Args:
        experiment: names the run.
        on_episode: called after each episode with how many are done and the episode's summed cost.
    """
    controller = Persistent(
        paper.nmpc(experiment.layout, horizon=experiment.horizon, solver=experiment.solver)
    )
    learner, weights, explore = prepare(experiment, controller)
    steps, evaluations = Table(), Table()
    evaluations.append(**_evaluation(controller, weights, 0, experiment.steps))
    stopped, cost, began = "finished", 0.0, time.perf_counter()
    try:
        for step in train(learner, controller, weights, explore):
            seconds = time.perf_counter() - began
            steps.append(**_row(step, experiment.alpha, seconds))
            cost += step.cost
            if step.failure or step.time == experiment.steps - 1:
                done = step.episode + 1
                due = done % experiment.evaluate_every == 0 or done == experiment.episodes
                if due and not absurd(step.weights):
                    row = _evaluation(controller, step.weights, done, experiment.steps)
                    evaluations.append(**row)
                if on_episode:
                    on_episode(done, cost)
                cost = 0.0
            began = time.perf_counter()
    except Diverged as error:
        stopped = f"diverged: {error}"
    table, judged = steps.columns(), evaluations.columns()
    facts = {
        "stopped": stopped,
        "seconds": float(table["seconds"].sum()),
        "final_cost": float(judged["cost"][-1]),  # of the last rollout without noise
    }
    return Records(asdict(experiment), table, judged, facts)


def prepare(experiment: Experiment, controller: Persistent) -> tuple[Learner, Weights, Exploration]:
    """The learner, its first weights and its noise: all that `train` needs besides `controller`.

    One child of the seed for the noise and one for the network, so that all learners of a seed meet
    the same noise.
    """
    noise, network = (
        np.random.default_rng(c) for c in np.random.SeedSequence(experiment.seed).spawn(2)
    )
    plant = controller.nmpc.plant
    shape = (experiment.episodes, experiment.steps)
    explore = Exploration(
        noise=noise.normal(scale=paper.NOISE, size=(*shape, plant.m)),
        scale=experiment.decay_rate ** DECAYS[experiment.decay](*shape),
    )
    theta = np.array(experiment.theta)
    weights = Weights(theta, np.full(theta.size, paper.W_INIT))
    return _learner(experiment, controller, network), weights, explore


def _learner(experiment: Experiment, controller: Persistent, rng: np.random.Generator) -> Learner:
    plant, alpha = controller.nmpc.plant, experiment.alpha

    def network(inputs: int) -> QNetwork:
        return QNetwork(inputs, rng, learning_rate=experiment.zeta, batch=paper.BATCH)

    match experiment.learner:
        case "ES":
            return expected_sarsa(controller, alpha)
        case "GES":
            return gradient_expected_sarsa(controller, alpha, experiment.beta)
        case "DES":
            inputs = plant.n + plant.m
            return deep_expected_sarsa(controller, network(inputs), alpha, gated=experiment.gated)
        case "RDES":
            inputs = plant.n + plant.m + len(experiment.theta)
            return regularized_deep_expected_sarsa(
                controller, network(inputs), alpha, gated=experiment.gated
            )
    return frozen(controller)


def _row(step: Step, alpha: float, seconds: float) -> dict[str, Any]:
    """The row of `Records.steps` for one step of training."""
    solution, update = step.solution, step.update
    successor = update.successor if update else None
    solutions = [s for s in (solution, successor and successor.solution) if s]
    restarted = any(s.status == "restarted" for s in solutions)
    phi = solution.features if solution else np.full(step.weights.theta.size, np.nan)
    return {
        "episode": step.episode,
        "time": step.time,
        "state": step.state,
        "action": step.action,
        "cost": step.cost,
        "value": solution.value if solution else np.nan,
        "next_value": successor.value if successor else np.nan,
        "delta": np.nan if update is None or update.delta is None else update.delta,
        "features": phi,
        "alpha_phi2": alpha * float(phi @ phi),
        "theta": step.weights.theta,
        "w": step.weights.w,
        "loss": successor.loss if successor else np.nan,
        "status": FAILED if step.failure else RESTARTED if restarted else SOLVED,
        "iterations": sum(s.iterations for s in solutions),
        "solves": len(solutions),
        "solve_seconds": sum(s.seconds for s in solutions),
        "fit_seconds": successor.seconds if successor else 0.0,
        "seconds": seconds,
    }


def _evaluation(
    controller: Persistent, weights: Weights, episode: int, steps: int
) -> dict[str, Any]:
    """The row of `Records.evaluations` for the policy of `weights`."""
    rollout = evaluate(controller, weights.theta, steps)
    missing = ((0, steps - len(rollout.states)), (0, 0))
    return {
        "episode": episode,
        "theta": weights.theta,
        "cost": rollout.cost,
        "states": np.pad(rollout.states, missing, constant_values=np.nan),
        "actions": np.pad(rollout.actions, missing, constant_values=np.nan),
    }
