"""An `Experiment` is a frozen value that names one run; `run` carries it out."""

import gc
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from nmpcrl.control import Plant
from nmpcrl.learning import (
    Learner,
    QNetwork,
    Successor,
    Weights,
    deep_expected_sarsa,
    expected_sarsa,
    frozen,
    gradient_expected_sarsa,
    regularized_deep_expected_sarsa,
)
from nmpcrl.study import paper
from nmpcrl.study.parameters import number, one_of, parameter_vector, true_or_false, whole
from nmpcrl.study.records import Field, Records, Table
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
SOLVERS = ("riccati", "fatrop", "ipopt")

SOLVED, RESTARTED, FAILED = range(3)  # the status column
UNKNOWN = Successor(np.nan)  # of a step that was not bootstrapped
UNSOLVED: Any = SimpleNamespace(  # stands in for a solve that failed or was not asked for
    value=np.nan,
    features=np.nan,
    restarts=0,
    violation=np.nan,  # max(a, nan) is a
    iterations=0,
    seconds=0.0,
)


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
    solver: str = "riccati"
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
    gc.freeze()  # the collector need not look through all that was imported, again and again
    try:
        return _run(experiment, on_episode)
    finally:
        gc.unfreeze()


def _run(experiment: Experiment, on_episode: Callable[[int, float], None] | None) -> Records:
    controller = Persistent(
        paper.nmpc(experiment.layout, horizon=experiment.horizon, solver=experiment.solver)
    )
    learner, weights, explore = prepare(experiment, controller)
    steps, evaluations = _tables(experiment, controller.nmpc.plant)
    evaluations.append(_evaluation(controller, weights, 0, experiment.steps))
    stopped, cost, began = "finished", 0.0, time.perf_counter()
    try:
        for step in train(learner, controller, weights, explore):
            seconds = time.perf_counter() - began
            steps.append(_row(step, seconds))
            cost += step.cost
            if step.failure or step.time == experiment.steps - 1:
                done = step.episode + 1
                due = done % experiment.evaluate_every == 0 or done == experiment.episodes
                if due and not absurd(step.weights):
                    row = _evaluation(controller, step.weights, done, experiment.steps)
                    evaluations.append(row)
                if on_episode:
                    on_episode(done, cost)
                cost = 0.0
            began = time.perf_counter()
    except Diverged as error:
        stopped = f"diverged: {error}"
    table, judged = steps.columns(), evaluations.columns()
    table["alpha_phi2"] = experiment.alpha * (table["features"] ** 2).sum(axis=1)
    facts = {
        "stopped": stopped,
        "solver": controller.nmpc.solver,  # fatrop where riccati was asked for and not to be had
        "seconds": float(table["seconds"].sum()),
        "final_cost": float(judged["cost"][-1]),  # of the last rollout without noise
    }
    return Records(asdict(experiment), table, judged, facts)


def compile_ahead(experiments: Iterable[Experiment]) -> None:
    """Compile what the runs will call, so that their processes find it done."""
    for layout, solver in dict.fromkeys((e.layout, e.solver) for e in experiments):
        nmpc = paper.nmpc(layout, solver=solver)
        solution = nmpc.solve(nmpc.task.start, np.array(paper.THETA_INIT))
        nmpc.plant.step(solution.state, solution.action)
        nmpc.task.stage_cost(solution.state, solution.action)


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


def _tables(experiment: Experiment, plant: Plant) -> tuple[Table, Table]:
    """Room for `Records.steps` and `Records.evaluations`."""
    n, m, d, steps = plant.n, plant.m, len(experiment.theta), experiment.steps
    step: list[Field] = [
        ("episode", int),
        ("time", int),
        ("state", float, n),
        ("action", float, m),
        ("cost", float),
        ("value", float),
        ("next_value", float),
        ("delta", float),
        ("features", float, d),
        ("theta", float, d),
        ("w", float, d),
        ("loss", float),
        ("status", int),
        ("restarts", int),
        ("violation", float),
        ("iterations", int),
        ("solves", int),
        ("solve_seconds", float),
        ("fit_seconds", float),
        ("seconds", float),
    ]
    evaluation: list[Field] = [
        ("episode", int),
        ("theta", float, d),
        ("cost", float),
        ("states", float, (steps, n)),
        ("actions", float, (steps, m)),
    ]
    rollouts = experiment.episodes // experiment.evaluate_every + 2  # the first and the last
    return Table(step, experiment.episodes * steps), Table(evaluation, rollouts)


def _row(step: Step, seconds: float) -> tuple[Any, ...]:
    """The row of `Records.steps` for one step of training, in the order of `_tables`."""
    update = step.update
    successor = (update and update.successor) or UNKNOWN
    first, second = step.solution or UNSOLVED, successor.solution or UNSOLVED
    restarts = first.restarts + second.restarts
    return (
        step.episode,
        step.time,
        step.state,
        step.action,
        step.cost,
        first.value,
        successor.value,
        np.nan if update is None or update.delta is None else update.delta,
        first.features,
        step.weights.theta,
        step.weights.w,
        successor.loss,
        FAILED if step.failure else RESTARTED if restarts else SOLVED,
        restarts,
        max(first.violation, second.violation),
        first.iterations + second.iterations,
        (first is not UNSOLVED) + (second is not UNSOLVED),
        first.seconds + second.seconds,
        successor.seconds,
        seconds,
    )


def _evaluation(
    controller: Persistent, weights: Weights, episode: int, steps: int
) -> tuple[Any, ...]:
    """The row of `Records.evaluations` for the policy of `weights`."""
    rollout = evaluate(controller, weights.theta, steps)
    missing = ((0, steps - len(rollout.states)), (0, 0))
    states, actions = (
        np.pad(driven, missing, constant_values=np.nan)
        for driven in (rollout.states, rollout.actions)
    )
    return episode, weights.theta, rollout.cost, states, actions
