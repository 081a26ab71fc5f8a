"""Algorithm 1 an episode at a time, as arrays: by the compiled `loop` where it can be."""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc, Solution
from nmpcrl.control.codegen.jit import compiled, load
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.control.solvers import riccati
from nmpcrl.control.solvers.codes import Start
from nmpcrl.learning.baselines import nothing
from nmpcrl.learning.bootstrap import Controller, Imitation, Moves, NextValue, SecondSolve
from nmpcrl.learning.learners import Learner, Weights
from nmpcrl.learning.network import QNetwork, Target, machine_code
from nmpcrl.learning.training import Exploration, Step, Trainer, absurd, trainer_of

NOTICE = "Compiling Algorithm 1 (once on this machine) ..."
COMPILED = """from numba import njit

from .loop import ABSENT, EXACT, FUNCTIONS, GRADIENT_TD, SEMI_GRADIENT, SIGNATURE, episode

signatures = (FUNCTIONS[1], *FUNCTIONS[4:])
absent = [njit(one, cache=True)(function) for one, function in zip(signatures, ABSENT)]
episode = njit(SIGNATURE, cache=True, error_model="numpy", no_cfunc_wrapper=True)(episode)
"""
TEXTS = {
    "__init__": COMPILED,
    "codes": riccati.TEXTS["codes"],
    **{
        name: files(__package__).joinpath(f"{name}.py").read_text("utf-8")
        for name in ("loop", "updates", "dense")
    },
}
NOTHING, SECOND_SOLVE, NETWORK = range(3)  # as in `loop`
NO_NETWORK = (
    np.zeros((1, 1), np.float32), np.zeros((0, 1), np.float32), np.zeros(0, np.int32),
    np.zeros(2, np.int64), np.zeros(1, np.uint64), np.ones(1), 0.0, np.zeros(4, np.int64),
)  # fmt: skip
NUMBERS = (  # a column each, as in `loop`; nan or 0 where there is none
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
    columns: dict[str, Matrix]  # `NUMBERS`, and state, action, features, theta and w after the step
    weights: Weights  # after it
    failure: str = ""  # what the solver said in the last step, or where the plant went
    solver: str = ""  # another than the controller's if it took over, if only once

    @property
    def steps(self) -> int:
        """How many steps were made."""
        return len(self.columns["cost"])


def episodes(
    learner: Learner,
    controller: Controller,
    weights: Weights,
    explore: Exploration,
    **options: Any,
) -> Iterator[Episode]:
    """The steps of `train` to the last bit, by episodes; the arguments are the same.

    For a learner that is built in, with riccati and a `Plant`, one compiled function makes them.
    A step of which it cannot make a part, as where fatrop takes over, is made by `train`.

    Raises:
        ValueError, Diverged: as `train`.
    """
    return _episodes(trainer_of(learner, controller, weights, explore, **options))


def _episodes(trainer: Trainer) -> Iterator[Episode]:
    loop, weights, failed = Loop.of(trainer), trainer.weights, 0
    for number in range(len(trainer.explore.scale)):
        made = _episode(trainer, loop, number, weights)
        weights = made.weights
        yield made
        trainer.judge(weights)
        failed = trainer.counted(failed, made.failure)


def _episode(trainer: Trainer, loop: "Loop | None", number: int, weights: Weights) -> Episode:
    """An episode; a step that the loop does not make is one of `train`, and then it goes on."""
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
            weights, failure = step.weights, step.failure
            others = (one.solver for one in step.solves if one.solver != nmpc.solver.name)
            solver = next(others, solver)
            if loop or absurd(weights, nmpc.largest):
                break
        if step.last or step.next_state is None:
            break
        state, warm = step.next_state, step.warm
    numbers, *parts = np.split(rows[:t], np.cumsum([len(NUMBERS), *sizes.values()])[:-1], axis=1)
    columns = dict(zip(NUMBERS, numbers.T, strict=True)) | dict(zip(sizes, parts, strict=True))
    return Episode(number, columns, weights, failure, solver)


def _row(step: Step) -> Vector:
    """A step as a row of `Episode`."""
    update, solution, solves, theta = step.update, step.solution, step.solves, step.weights.theta
    after = (update and update.successor) or NextValue(np.nan)
    numbers = {
        "cost": step.cost,
        "value": solution.value if solution else np.nan,
        "next_value": after.value,
        "delta": np.nan if update is None or update.delta is None else update.delta,
        "loss": after.loss,
        "restarts": sum(one.restarts for one in solves),
        "violation": max((one.violation for one in solves), default=np.nan),
        "iterations": sum(one.iterations for one in solves),
        "solves": len(solves),
    }
    features = solution.features if solution else np.full(theta.size, np.nan)
    row = [numbers[name] for name in NUMBERS]
    return np.concatenate([row, step.state, step.action, features, theta, step.weights.w])


class Loop:
    """`loop.episode` with the learner, the plant and the controller of a trainer."""

    def __init__(
        self, trainer: Trainer, moves: Moves, machine: Any, fixed: Any, *functions: Any
    ) -> None:
        """Compile it, if that was not done before on this machine.

        Args:
            trainer: has everything else.
            moves: how theta moves; step sizes of 0 where nothing is learned.
            machine: the solver, as `Nmpc.machine` returns it.
            fixed: the one with u_0 fixed where Q(s, a) is learned, else `machine`.
            functions: the plant and its cost, compiled.
        """
        code, nmpc, learner = load("loop", TEXTS, NOTICE), trainer.nmpc, trainer.learner
        problem, given_action = machine.arguments, fixed.arguments
        place = fixed.place if trainer.constrained else 0
        least, most = moves.projection or learner.bounds or (-np.inf, np.inf)
        d, rule = trainer.weights.theta.size, code.SEMI_GRADIENT
        slopes, *network = code.absent
        if moves.beta is not None:
            rule = code.EXACT if moves.curvature else code.GRADIENT_TD
        if moves.curvature:
            slopes = machine.slopes
        self._machine, self._nmpc, self._episode = machine, nmpc, code.episode
        self._valued = learner.bootstrap
        if isinstance(self._valued, Imitation):
            network = machine_code().entries
        next_input = int(nmpc.ocp.inputs[min(1, nmpc.horizon - 1)][0])
        self._given = (
            machine.code, slopes, *functions, *network, tuple(problem), tuple(given_action),
            machine.others, machine.drawn, machine.tolerance,
            place, next_input, nmpc.farthest, nmpc.largest,
            rule, moves.alpha, moves.beta or 0.0, np.full(d, least), np.full(d, most),
        )  # fmt: skip
        self._how = trainer.constrained, trainer.clipped
        self._size = 2 * nmpc.ocp.lower.size + nmpc.ocp.equality.size  # z, lam and nu

    @classmethod
    def of(cls, trainer: Trainer) -> "Loop | None":
        """None where a part is none of those that it knows, or cannot be compiled."""
        learner, nmpc, plant = trainer.learner, trainer.nmpc, trainer.plant
        valued = learner.bootstrap
        moves = Moves(0.0) if valued is nothing else getattr(learner.rule, "moves", None)
        if not (_known(valued, nmpc) and moves and plant and type(learner) is Learner):
            return None
        if trainer.controller is not nmpc or type(nmpc) is not Nmpc:
            return None
        if {learner.gamma, moves.gamma or learner.gamma} != {nmpc.gamma} or (
            learner.bounds and moves.projection
        ):
            return None
        machine = nmpc.machine(fix_action=False)
        fixed = nmpc.machine(fix_action=True) if trainer.constrained else machine
        if machine is None or fixed is None:
            return None
        assert nmpc.task  # or the environment would be no plant
        step, cost = plant.transition, nmpc.task.charge(nmpc.m)
        try:
            functions = compiled(step, returned=False), compiled(cost, returned=True)
            return cls(trainer, moves, machine, fixed, *functions)
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
        done = self._episode(
            *self._given, *self._bootstrap(len(rows) - first), *self._how, int(start), first,
            state, theta, w, point, noise, rows,
        )  # fmt: skip
        if done > first:
            nmpc, weights = self._nmpc, Weights(theta, w)
            x, none = point[: state.size], np.empty(0)
            warm = Solution(x, theta, np.nan, none, 0, 0.0, point, nmpc.ocp, nmpc.solver.name)
        return done, state, weights, warm

    def _bootstrap(self, steps: int) -> tuple[Any, ...]:
        """The kind of the bootstrap, its network and target, with room for so many steps."""
        valued = self._valued
        if not isinstance(valued, Imitation):
            kind = NOTHING if valued is nothing else SECOND_SOLVE
            return kind, NO_NETWORK, NO_NETWORK, (False, False, False, 0, 0, 0.0)
        valued.network.reserve(steps)
        net, target = valued.network.net, valued.target
        how = valued.with_theta, valued.gated, valued.late, valued.fits
        if target is None:
            return NETWORK, net, net, (*how, 0, 0.0)
        return NETWORK, net, target.net, (*how, target.every, float(target.rate))


def _known(valued: Any, nmpc: Nmpc) -> bool:
    """Whether the loop knows a bootstrap."""
    if type(valued) is Imitation:
        known = type(valued.network) is QNetwork and type(valued.target) in (Target, type(None))
        return known and valued.actions is None
    return valued is nothing or (type(valued) is SecondSolve and valued.nmpc is nmpc)
