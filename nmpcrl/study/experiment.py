"""An `Experiment` is a frozen value that names one run; `run` carries it out."""

import gc
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Plant, solvers
from nmpcrl.learning import (
    Learner,
    QNetwork,
    Successor,
    Weights,
    deep_expected_sarsa,
    expected_sarsa,
    frozen,
    gradient_expected_sarsa,
    gradient_tdc,
    q_learning,
    random_direction,
    regularized_deep_expected_sarsa,
    step_matched,
)
from nmpcrl.learning.rollout import Persistent, evaluate
from nmpcrl.learning.training import (
    Diverged,
    Exploration,
    Step,
    absurd,
    count_episodes,
    count_steps,
    train,
)
from nmpcrl.study import paper
from nmpcrl.study.parameters import (
    ParameterError,
    number,
    one_of,
    parameter_vector,
    true_or_false,
    whole,
)
from nmpcrl.study.records import Field, Records, Table

PAPER = ("ES", "DES", "RDES", "GES")  # the paper's learners
CONTROLS = ("frozen", "matched", "random")  # what a learner is held against
LEARNERS = (*PAPER, "TDC", "QL", *CONTROLS)
MAIN = (*PAPER, "TDC", "frozen")  # of the main table
NETWORK_LEARNERS = ("DES", "RDES")
DECAYS = {"step": count_steps, "episode": count_episodes}
SOLVERS = tuple(solvers.SOLVERS)
NETWORKS = ("plain", "normalised", "tanh", "small buffer", "four fits")  # departure H
SMALL_BUFFER = 10 * paper.STEPS  # examples
THETA_SET = (0.0, 10.0)  # each component of theta is projected into it by TDC
LEAST_SCALE = 1e-3  # that an input of the normalised network is divided by

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
    clipped: bool = True  # False: the noise may leave the action space  # departure E
    constrained: bool = False  # True: Q(s, a), with u_0 = a fixed, instead of V(s)  # departure F
    network: str = "plain"  # departure H
    box: str = "hard"  # departures A and M
    ties_active: bool = False  # the other side of the kink in theta_c  # departure L
    curvature: bool = True  # of TDC: subtract h
    projected: bool = True  # of TDC: keep theta in `THETA_SET`
    beta_tdc: float = paper.BETA_TDC  # step size of w in TDC
    theta: tuple[float, ...] = paper.THETA_INIT
    steps: int = paper.STEPS  # of an episode
    horizon: int = paper.HORIZON
    solver: str = "riccati"
    tolerance: float = solvers.TOLERANCE  # of the solver
    evaluate_every: int = 10  # episodes between rollouts without noise

    def __post_init__(self) -> None:
        one_of(self, "learner", LEARNERS)
        one_of(self, "layout", tuple(paper.LAYOUTS))
        one_of(self, "decay", tuple(DECAYS))
        one_of(self, "solver", SOLVERS)
        one_of(self, "network", NETWORKS)
        one_of(self, "box", paper.BOXES)
        whole(self, "seed", least=0)
        for name in ("episodes", "steps", "horizon", "evaluate_every"):
            whole(self, name, least=1)
        for name in ("alpha", "beta", "beta_tdc", "zeta"):
            number(self, name, "a positive number", lambda value: value > 0)
        number(self, "decay_rate", "a number in (0, 1]", lambda value: 0 < value <= 1)
        least, largest = solvers.LEAST_TOLERANCE, solvers.LARGEST_TOLERANCE
        allowed = f"a number in [{least:g}, {largest:g}]"
        number(self, "tolerance", allowed, lambda value: least <= value <= largest)
        for name in ("gated", "clipped", "constrained", "ties_active", "curvature", "projected"):
            true_or_false(self, name)
        parameter_vector(self, "theta", len(paper.THETA_INIT))
        if self.values_actions and not self.clipped:
            raise ParameterError(
                f"clipped = False leaves actions that {self.learner} with constrained ="
                f" {self.constrained} cannot value: they are outside the OCP's bounds"
            )

    @property
    def values_actions(self) -> bool:
        """Whether Q(s, a) proper is learned, with u_0 = a fixed, and not V(s)."""
        return self.constrained or self.learner == "QL"

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
    controller = controller_of(experiment)
    learner, weights, explore = prepare(experiment, controller)
    steps, evaluations = _tables(experiment, controller.nmpc.plant)
    evaluations.append(_evaluation(controller, weights, 0, experiment.steps))
    stopped, cost, began = "finished", 0.0, time.perf_counter()
    solver = controller.nmpc.solver.name
    try:
        options = {"clipped": experiment.clipped, "constrained": experiment.values_actions}
        for step in train(learner, controller, weights, explore, **options):
            seconds = time.perf_counter() - began
            steps.append(_row(step, seconds))
            cost += step.cost
            solver = step.plan.solver if step.plan else solver
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
        "solver": solver,  # what solved: fatrop where riccati was not to be had
        "seconds": float(table["seconds"].sum()),
        "final_cost": float(judged["cost"][-1]),  # of the last rollout without noise
    }
    return Records(asdict(experiment), table, judged, facts)


def controller_of(experiment: Experiment) -> Persistent:
    """The controller whose theta is learned."""
    nmpc = paper.nmpc(
        experiment.layout,
        horizon=experiment.horizon,
        solver=solvers.SOLVERS[experiment.solver](tolerance=experiment.tolerance),
        box=experiment.box,
        ties_active=experiment.ties_active,
    )
    return Persistent(nmpc)


def frozen_arm(experiment: Experiment) -> Experiment:
    """The control arm of a run: the same noise and the same controller, and theta never moves."""
    usual = Experiment()
    learned = ("alpha", "beta", "zeta", "gated", "constrained", "network", "curvature", "projected")
    kept = {name: getattr(usual, name) for name in (*learned, "beta_tdc", "ties_active")}
    return replace(experiment, learner="frozen", **kept)


def compile_ahead(experiments: Iterable[Experiment]) -> None:
    """Compile what the runs will call, so that their processes find it done."""
    kinds = {(e.layout, e.box, e.solver, e.learner == "TDC"): e for e in experiments}
    for experiment in kinds.values():
        controller = controller_of(experiment)
        nmpc, theta = controller.nmpc, np.array(paper.THETA_INIT)
        solution = nmpc.solve(nmpc.task.start, theta)
        nmpc.plant.step(solution.state, solution.action)
        nmpc.task.stage_cost(solution.state, solution.action)
        if experiment.learner == "TDC":
            nmpc.value_hessian_times(solution, theta)


def prepare(experiment: Experiment, controller: Persistent) -> tuple[Learner, Weights, Exploration]:
    """The learner, its first weights and its noise: all that `train` needs besides `controller`.

    One child of the seed each for the noise, the network and a control's directions, so that all
    learners of a seed meet the same noise.
    """
    noise, network, directions = (
        np.random.default_rng(c) for c in np.random.SeedSequence(experiment.seed).spawn(3)
    )
    plant = controller.nmpc.plant
    shape = (experiment.episodes, experiment.steps)
    explore = Exploration(
        noise=noise.normal(scale=paper.NOISE, size=(*shape, plant.m)),
        scale=experiment.decay_rate ** DECAYS[experiment.decay](*shape),
    )
    theta = np.array(experiment.theta)
    weights = Weights(theta, np.full(theta.size, paper.W_INIT))
    if experiment.learner in NETWORK_LEARNERS:
        learner = _network_learner(experiment, controller, network)
    else:
        learner = _solving_learner(experiment, controller, directions)
    return learner, weights, explore


def _solving_learner(
    experiment: Experiment, controller: Persistent, rng: np.random.Generator
) -> Learner:
    """A learner that asks the NMPC for the next value, or asks for none."""
    alpha, beta = experiment.alpha, experiment.beta
    match experiment.learner:
        case "ES":
            return expected_sarsa(controller, alpha)
        case "GES":
            return gradient_expected_sarsa(controller, alpha, beta)
        case "TDC":
            return gradient_tdc(
                controller,
                alpha,
                experiment.beta_tdc,
                curvature=experiment.curvature,
                projection=THETA_SET if experiment.projected else None,
            )
        case "QL":
            return q_learning(controller, alpha)
        case "matched":
            return step_matched(controller, alpha, beta)
        case "random":
            return random_direction(controller, alpha, rng)
    return frozen(controller)


def _network_learner(
    experiment: Experiment, controller: Persistent, rng: np.random.Generator
) -> Learner:
    """A learner that asks a network for the next value: DES or RDES."""
    plant, told = controller.nmpc.plant, experiment.learner == "RDES"
    options: dict[str, Any] = {
        "normalised": {"scales": _scales(controller, experiment.theta, told=told)},
        "tanh": {"activation": "tanh"},
        "small buffer": {"memory": SMALL_BUFFER},
    }
    inputs = plant.n + plant.m + told * len(experiment.theta)
    network = QNetwork(
        inputs,
        rng,
        learning_rate=experiment.zeta,
        batch=paper.BATCH,
        **options.get(experiment.network, {}),
    )
    make = regularized_deep_expected_sarsa if told else deep_expected_sarsa
    fits = 4 if experiment.network == "four fits" else 1
    return make(controller, network, experiment.alpha, gated=experiment.gated, fits=fits)


def _scales(
    controller: Persistent, theta: tuple[float, ...], *, told: bool
) -> tuple[Vector, float]:
    """What the inputs and the target of the normalised network are divided by.

    A state by the box's half width, or pi where it has none; an action by its bound; theta by
    theta_init; the value by that of theta_init at the start.
    """
    nmpc = controller.nmpc
    half = (nmpc.task.upper - nmpc.task.lower) / 2
    state = np.where(np.isfinite(half), half, np.pi)
    parts = [state, nmpc.plant.upper, *([np.abs(theta)] if told else [])]
    value = nmpc.solve(nmpc.task.start, np.array(theta)).value
    return np.maximum(np.concatenate(parts), LEAST_SCALE), max(abs(value), LEAST_SCALE)


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
    first = step.solution or UNSOLVED
    solves = list(dict.fromkeys(filter(None, (step.plan, step.solution, successor.solution))))
    restarts = sum(solve.restarts for solve in solves)
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
        max((solve.violation for solve in solves), default=np.nan),
        sum(solve.iterations for solve in solves),
        len(solves),
        sum(solve.seconds for solve in solves),
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
