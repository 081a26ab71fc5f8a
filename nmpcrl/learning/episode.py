"""Algorithm 1 an episode at a time, as arrays: by the compiled `loop` where it can be."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib.resources import files
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc, Plant, Solution, Task
from nmpcrl.control.codegen.jit import compiled, load
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.control.solvers import riccati
from nmpcrl.control.solvers.codes import Start
from nmpcrl.learning.baselines import nothing
from nmpcrl.learning.bootstrap import Imitation, NextValue, SecondSolve
from nmpcrl.learning.learners import GradientTD, Learner, SemiGradient, Weights
from nmpcrl.learning.network import QNetwork, Target, machine_code
from nmpcrl.learning.training import Exploration, Step, Trainer, absurd
from nmpcrl.learning.updates import auxiliary_step

NOTICE = "Compiling Algorithm 1 (once on this machine) ..."
COMPILED = """from numba import njit

from . import loop

signatures = (loop.FUNCTIONS[1], *loop.FUNCTIONS[4:])
absent = [njit(one, cache=True)(function) for one, function in zip(signatures, loop.ABSENT)]
options = {"error_model": "numpy", "no_cfunc_wrapper": True}
episode = njit(loop.SIGNATURE, cache=True, **options)(loop.episode)
"""
TEXTS = {
    "__init__": COMPILED,
    "codes": riccati.TEXTS["codes"],
    **{
        name: files(__package__).joinpath(f"{name}.py").read_text("utf-8")
        for name in ("loop", "updates", "dense")
    },
}
NO_NETWORK = (
    np.zeros((1, 1), np.float32), np.zeros((0, 1), np.float32), np.zeros(0, np.int32),
    np.zeros(2, np.int64), np.zeros(1, np.uint64), np.ones(1), 0.0, np.zeros(4, np.int64),
)  # fmt: skip
NUMBERS = (  # a column each, which `loop` knows by its place; nan or 0 where there is none
    "cost",  # l(s, a)
    "value",  # Q(s, a)
    "next_value",  # Q(s+, a+)
    "delta",  # TD error
    "loss",  # of the network's last fit
    "restarts",  # of the step's solves, like the next three
    "violation",
    "iterations",
    "solves",
)


@dataclass(frozen=True, eq=False)
class Episode:
    """The steps of an episode, one row each."""

    number: int
    columns: dict[str, Matrix]  #: `NUMBERS`, state, action, features, theta and w after the step
    weights: Weights  #: after it
    failure: str = ""  #: what the solver said in the last step, or where the plant went
    solver: str = ""  #: another than the controller's where that cannot be compiled

    @property
    def steps(self) -> int:
        """How many steps were made."""
        return len(self.columns["cost"])


def episodes(
    learner: Learner, controller: Nmpc, weights: Weights, explore: Exploration, **options: Any
) -> Iterator[Episode]:
    """The steps of `train` to the last bit, by episodes; the arguments are the same.

    For a learner that is built in, with riccati and a `Plant`, one compiled function makes them,
    and `train` a step in which that fails, as where Ipopt takes over.
    """
    trainer = Trainer(learner, controller, weights, explore, **options)
    return trainer.run(partial(_episode, trainer, Loop.of(trainer)))


def _episode(
    trainer: Trainer, loop: "Loop | None", number: int, weights: Weights
) -> Iterator[Episode]:
    """One episode: the steps of the loop, and of `train` where there is none or it fails."""
    nmpc, d, failure, solver = trainer.nmpc, weights.theta.size, "", ""
    sizes = {"state": nmpc.n, "action": nmpc.m, "features": d, "theta": d, "w": d}
    noise = np.ascontiguousarray(trainer.explore.scaled[number])
    rows, t = np.empty((len(noise), len(NUMBERS) + sum(sizes.values()))), 0
    state, warm = trainer.environment.start(trainer.rng), None
    while True:
        if loop:
            t, state, weights, warm = loop.run(t, state, weights, warm, noise, rows)
        if t == len(rows) or absurd(weights, nmpc.largest):
            break
        for step in trainer.steps(number, t, state, weights, warm):
            rows[t], t = _row(step), t + 1
            before, weights, failure = weights, step.weights, step.failure
            solves = [one for one in step.solves if not one.took_over]
            solver = next((one.solver for one in solves if one.solver != nmpc.solver.name), solver)
            if loop or (weights is not before and absurd(weights, nmpc.largest)):
                break
        if step.last or step.next_state is None:
            break
        state, warm = step.next_state, step.warm
    numbers, *parts = np.split(rows[:t], np.cumsum([len(NUMBERS), *sizes.values()])[:-1], axis=1)
    columns = dict(zip(NUMBERS, numbers.T, strict=True)) | dict(zip(sizes, parts, strict=True))
    yield Episode(number, columns, weights, failure, solver)


def _row(step: Step) -> Vector:
    """A step as a row of `Episode`."""
    update, solution, solves, weights = step.update, step.solution, step.solves, step.weights
    after = (update and update.successor) or NextValue(np.nan)
    numbers = (
        step.cost,
        solution.value if solution else np.nan,
        after.value,
        np.nan if update is None or update.delta is None else update.delta,
        after.loss,
        sum(one.restarts for one in solves),
        max((one.violation for one in solves), default=np.nan),
        sum(one.iterations for one in solves),
        len(solves),
    )
    features = solution.features if solution else np.full(weights.theta.size, np.nan)
    return np.concatenate([numbers, step.state, step.action, features, weights.theta, weights.w])


class Loop:
    """`loop.episode` with the learner, the plant and the controller of a trainer."""

    def __init__(self, trainer: Trainer) -> None:
        """Compile it, if that was not done before on this machine.

        Raises:
            CannotCompile: the loop does not know a part.
        """
        learner, nmpc, plant = trainer.learner, trainer.nmpc, trainer.plant
        step, own = _known_step(learner, nmpc), type(nmpc) is Nmpc
        machine = nmpc.machine(fix_action=False) if own and step and plant else None
        fixed = nmpc.machine(fix_action=True) if machine and trainer.constrained else machine
        if not (plant and step and machine and fixed):
            raise CannotCompile("the loop does not know this learner, plant or solver")
        advance, cost = environment_code(plant, nmpc.task)
        code = load("loop", TEXTS, NOTICE)
        self._code, self._machine, self._nmpc, self._valued = code, machine, nmpc, learner.bootstrap
        (slopes, *network), rule, beta = code.absent, code.loop.SEMI_GRADIENT, 0.0
        if isinstance(step, GradientTD):
            rule, beta = code.loop.GRADIENT_TD, step.beta
            if step.curved:
                rule, slopes = code.loop.EXACT, machine.slopes
        if isinstance(self._valued, Imitation):
            network = machine_code().entries
        place = fixed.place if trainer.constrained else 0
        next_input = int(nmpc.ocp.inputs[min(1, nmpc.horizon - 1)][0])
        theta = trainer.weights.theta
        bounds = (np.full_like(theta, one) for one in learner.bounds or (-np.inf, np.inf))
        self._given = (
            machine.code, slopes, advance, cost, *network,
            tuple(machine.arguments), tuple(fixed.arguments),
            machine.others, machine.drawn, machine.tolerance,
            place, next_input, nmpc.farthest, nmpc.largest, rule, step.alpha, beta, *bounds,
        )  # fmt: skip
        self._how = trainer.constrained, trainer.clipped
        self._size = 2 * nmpc.ocp.lower.size + nmpc.ocp.equality.size  # z, lam and nu

    @classmethod
    def of(cls, trainer: Trainer) -> "Loop | None":
        """The loop of a trainer; None where it does not know a part, or cannot be compiled."""
        try:
            return cls(trainer)
        except CannotCompile:
            return None

    def run(
        self,
        first: int,
        state: Vector,
        weights: Weights,
        warm: Solution | None,
        noise: Matrix,
        rows: Matrix,
    ) -> tuple[int, Vector, Weights, Solution | None]:
        """Make steps from the first on, and write their rows.

        Returns the first step that is not made, and its state, weights and warm start.
        """
        start, point = Start.COLD, np.zeros(self._size)
        if warm is not None:
            start = Start.SAME if warm.state.tolist() == state.tolist() else Start.SHIFTED
            point[:] = self._machine.point_of(warm)
        state, theta, w = state.copy(), weights.theta.copy(), weights.w.copy()
        done = self._code.episode(
            *self._given, *self._bootstrap(len(rows) - first), *self._how, int(start), first,
            state, theta, w, point, noise, rows,
        )  # fmt: skip
        if done > first:
            nmpc, weights = self._nmpc, Weights(theta, w)
            x, none = point[: state.size], np.empty(0)
            how, data = nmpc.solver.name, nmpc.problem.stage_data(None)
            warm = Solution(x, theta, np.nan, none, 0, 0.0, point, nmpc.ocp, how, data)
        return done, state, weights, warm

    def _bootstrap(self, steps: int) -> tuple[Any, ...]:
        """The kind of the bootstrap, its network and target, with room for so many steps."""
        valued, kinds = self._valued, self._code.loop
        if not isinstance(valued, Imitation):
            kind = kinds.NOTHING if valued is nothing else kinds.SECOND_SOLVE
            return kind, NO_NETWORK, NO_NETWORK, (False, False, False, 0, 0, 0.0)
        valued.network.reserve(steps)
        net, target = valued.network.net, valued.target
        predicts, every, rate = (target.net, target.every, target.rate) if target else (net, 0, 0.0)
        how = valued.with_theta, valued.gated, valued.late, valued.fits, every, float(rate)
        return kinds.NETWORK, net, predicts, how


@lru_cache(maxsize=256)
def environment_code(plant: Plant, task: Task) -> tuple[Any, Any]:
    """The transition of a plant and the cost of a task, compiled."""
    return compiled(plant.transition), compiled(task.charge(plant.m), returned=True)


def _known_step(learner: Learner, nmpc: Nmpc) -> SemiGradient | GradientTD | None:
    """The step of a learner that the loop knows; one that never learns has step size 0."""
    valued, step = learner.bootstrap, learner.rule.step
    if type(learner) is not Learner or learner.gamma != nmpc.gamma:
        return None
    if valued is nothing:
        return SemiGradient(0.0)
    if type(valued) is Imitation:
        network, target = valued.network, valued.target
        known = target is None or (type(target) is Target and target.network is network)
        inputs = nmpc.n + nmpc.m + valued.with_theta * nmpc.problem.theta.size
        known = known and type(network) is QNetwork and network.inputs == inputs
        known = known and valued.actions is None
    else:
        known = type(valued) is SecondSolve and valued.nmpc is nmpc
    if type(step) is GradientTD:
        own = step.follow is auxiliary_step and (step.curved is None or step.curved is nmpc)
        own = own and step.gamma == nmpc.gamma and type(valued) is SecondSolve
        return step if known and own else None
    return step if known and type(step) is SemiGradient else None
