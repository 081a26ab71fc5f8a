"""Algorithm 1 an episode at a time, as arrays: by the compiled `loop` where it can be."""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc, Solution
from nmpcrl.control.codegen.jit import CannotCompile, compiled, load
from nmpcrl.control.solvers import riccati
from nmpcrl.control.solvers.codes import Start
from nmpcrl.learning.baselines import nothing
from nmpcrl.learning.bootstrap import Controller, Moves, NextValue, SecondSolve
from nmpcrl.learning.learners import Learner, Weights
from nmpcrl.learning.training import Exploration, Step, Trainer, absurd, trainer_of

NOTICE = "Compiling Algorithm 1 (once on this machine) ..."
BEGIN = """from numba import njit

from .loop import EXACT, GRADIENT_TD, SEMI_GRADIENT, SIGNATURE, episode, no_slopes

episode = njit(SIGNATURE, cache=True, error_model="numpy")(episode)
"""
TEXTS = {
    "__init__": BEGIN,
    "codes": riccati.TEXTS["codes"],
    **{
        name: files(__package__).joinpath(f"{name}.py").read_text("utf-8")
        for name in ("loop", "updates")
    },
}
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

    For a learner that is built in, with riccati and a `Plant`, they are made by one compiled
    function, twice as fast. What it cannot do is done by `train`, a step at a time: an episode's
    first solve, a solve that fails, and a plant that runs away.

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
    """An episode; after each step of `train` the loop goes on, where there is one."""
    nmpc, d, failure, solver = trainer.nmpc, weights.theta.size, "", ""
    sizes = {"state": nmpc.n, "action": nmpc.m, "features": d, "theta": d, "w": d}
    noise = np.ascontiguousarray(trainer.explore.scaled[number])
    rows, t = np.empty((len(noise), len(NUMBERS) + sum(sizes.values()))), 0
    state, warm = trainer.environment.start(trainer.rng), None
    while t < len(rows) and not absurd(weights, nmpc.largest):
        for step in trainer.steps(number, t, state, weights, warm):
            rows[t], t = _row(step), t + 1
            weights, failure = step.weights, step.failure
            others = (one.solver for one in step.solves if one.solver != nmpc.solver.name)
            solver = next(others, solver)
            if loop or absurd(weights, nmpc.largest):
                break
        if step.last or not loop:
            break
        t, state, weights, warm = loop.run(t, step, noise, rows)
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

    def __init__(self, trainer: Trainer, moves: Moves, machine: Any, *functions: Any) -> None:
        """Compile it, if that was not done before on this machine.

        Args:
            trainer: has everything else.
            moves: how theta moves; step sizes of 0 where nothing is learned.
            machine: the solver, as `Nmpc.machine` returns it.
            functions: the plant and its cost, compiled.
        """
        code, nmpc, learner = load("loop", TEXTS, NOTICE), trainer.nmpc, trainer.learner
        given, kind, place = machine.arguments, machine.arguments.kind, 0
        if trainer.constrained:
            fixed = nmpc.machine(fix_action=True)
            kind, place = fixed.arguments.kind, fixed.place
        least, most = moves.projection or learner.bounds or (-np.inf, np.inf)
        d, slopes, rule = trainer.weights.theta.size, code.no_slopes, code.SEMI_GRADIENT
        if moves.beta is not None:
            rule = code.EXACT if moves.curvature else code.GRADIENT_TD
        if moves.curvature:
            slopes = machine.slopes
        self._machine, self._nmpc, self._episode = machine, nmpc, code.episode
        self._given = (
            machine.code, slopes, *functions, *given[:5], kind, *given[5:],
            machine.others, machine.drawn, machine.tolerance, place, nmpc.farthest, nmpc.largest,
            rule, moves.alpha, moves.beta or 0.0, np.full(d, least), np.full(d, most),
            learner.bootstrap is not nothing, trainer.constrained, trainer.clipped,
        )  # fmt: skip

    @classmethod
    def of(cls, trainer: Trainer) -> "Loop | None":
        """None where a part is none of those that it knows, or cannot be compiled."""
        learner, nmpc, plant = trainer.learner, trainer.nmpc, trainer.plant
        valued = learner.bootstrap
        moves = Moves(0.0) if valued is nothing else getattr(learner.rule, "moves", None)
        known = valued is nothing or (type(valued) is SecondSolve and valued.nmpc is nmpc)
        if not (known and moves and plant and type(learner) is Learner):
            return None
        if trainer.controller is not nmpc or type(nmpc) is not Nmpc:
            return None
        if {learner.gamma, moves.gamma or learner.gamma} != {nmpc.gamma} or (
            learner.bounds and moves.projection
        ):
            return None
        machine = nmpc.machine(fix_action=False)
        if machine is None:
            return None
        assert nmpc.task  # or the environment would be no plant
        step, cost = plant.transition, nmpc.task.charge(nmpc.m)
        try:
            functions = compiled(step, returned=False), compiled(cost, returned=True)
            return cls(trainer, moves, machine, *functions)
        except CannotCompile:
            return None

    def run(
        self, first: int, last: Step, noise: Matrix, rows: Matrix
    ) -> tuple[int, Vector, Weights, Solution]:
        """Make the steps that follow another one, and write their rows.

        Returns the first step that is not made, and its state, weights and warm start.
        """
        warm, state = last.warm, np.array(last.next_state)
        theta, w = last.weights.theta.copy(), last.weights.w.copy()
        point = self._machine.point_of(warm).copy()
        start = Start.SAME if warm.state.tolist() == state.tolist() else Start.SHIFTED
        done = self._episode(*self._given, int(start), first, state, theta, w, point, noise, rows)
        n, nmpc = state.size, self._nmpc
        warm = Solution(point[:n], theta, np.nan, w, 0, 0.0, point, nmpc.ocp, nmpc.solver.name)
        return done, state, Weights(theta, w), warm
