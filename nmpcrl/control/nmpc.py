"""The controller: Eq. (2) solved in a state, with the value's gradient in theta.

`Nmpc.solve(state, theta)` is the value V_theta(s), the paper's Q_theta(s, a) of Eq. (3);
`Nmpc.solve(state, theta, action=a)` fixes u_0 = a and is the action value proper.
"""

import math
import time
from collections.abc import Mapping
from functools import cached_property
from multiprocessing import cpu_count
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.batch import Batch, solve_many, stage_data, table
from nmpcrl.control.bending import Bending
from nmpcrl.control.content import Described
from nmpcrl.control.diagnosis import FARTHEST
from nmpcrl.control.ocp import Ocp, transcribe
from nmpcrl.control.plant import Plant
from nmpcrl.control.problem import Problem
from nmpcrl.control.sensitivity import Gradient, Sensitivity
from nmpcrl.control.solution import Solution, SolverError, short
from nmpcrl.control.solvers import Asked, Riccati, Solver, solver_of
from nmpcrl.control.solvers.riccati import Compiled
from nmpcrl.control.task import Task
from nmpcrl.control.variant import Variant
from nmpcrl.control.vectors import floats, integer

ABSURD = 1e6  # no theta or action beyond this reaches a solver: fatrop never returns from some
FAR = 1e3  # nor does a state: from 1e4 outside the box fatrop never returns either

DEFAULT = Riccati()
HORIZON, GAMMA, SLACK_WEIGHT = 10, 0.97, 100.0
FREE = np.empty(0)  # no u_0 is given


class Nmpc(Described):
    """Eq. (2) for one plant and one task, or a `Problem`, as a function of state and theta.

    It can be pickled and copied; a copy solves as the original does, to the last bit. Derivatives
    beyond the gradient raise `DerivativeError`, a `SolverError`, where the optimum moves in a
    direction without curvature.
    """

    def __init__(
        self,
        plant: Plant | Problem,
        task: Task | None = None,
        horizon: int = HORIZON,
        gamma: float = GAMMA,
        slack_weight: float = SLACK_WEIGHT,
        solver: Solver | str = DEFAULT,
        *,
        ties_active: bool = False,
    ) -> None:
        """Check the problem; it is transcribed at the first solve.

        Args:
            plant: the model of the prediction, the robot of Eq. (18) in the paper; or a `Problem`,
                without the next four.
            task: target, box and obstacles.
            horizon: N, the number of planned inputs.
            gamma: discount factor, 0 < gamma <= 1.
            slack_weight: omega, the cost of a unit of each slack.
            solver: `Riccati()`, which is compiled for the plant at its first solve and gives way to
                fatrop with a warning where that cannot be done; `Fatrop()`; `Ipopt()`; or the
                name of one of them.
            ties_active: whether a state exactly on an obstacle's boundary counts as in it: the
                other side of a kink in theta_c.  # departure L
        """
        self.solver = solver_of(solver)
        self.plant: Plant = None  # type: ignore[assignment]  # where there is no task, as the next
        self.task: Task = None  # type: ignore[assignment]
        self.slack_weight: float = None  # type: ignore[assignment]
        if isinstance(plant, Problem):
            if task is not None or (horizon, gamma, slack_weight) != (HORIZON, GAMMA, SLACK_WEIGHT):
                raise ValueError(
                    "a Problem has its own costs, horizon, gamma and weights: write"
                    " Nmpc(problem, solver=...)"
                )
            self.problem = plant
        else:
            if task is None:
                raise ValueError("a plant needs a task: write Nmpc(plant, task)")
            if not 0 < slack_weight < np.inf:
                raise ValueError(f"slack_weight = {slack_weight} must be a positive number")
            if task.start.size != plant.n:
                raise ValueError(f"the task has {task.start.size} states and the plant {plant.n}")
            self.plant, self.task, self.slack_weight = plant, task, float(slack_weight)
            self.problem = task.problem(plant, horizon, gamma, self.slack_weight)
        of = self.problem
        self.horizon, self.gamma, self.n, self.m = of.horizon, of.gamma, of.states, of.inputs
        self.largest = max(ABSURD, 1e3 * float(np.abs(of.theta).max()))  # number in theta
        self.lower, self.upper = of.lower, of.upper
        reach, strength = (
            np.abs(box)[np.isfinite(box)].max(initial=0.0)
            for box in (np.array([of.state_lower, of.state_upper]), np.array([of.lower, of.upper]))
        )
        far = max(FAR, 100 * reach) if reach else FARTHEST * max(1.0, *of.sizes[0])
        self.farthest = far  # number in a state
        self._strongest = max(far, strength)  # number in an action
        self.ties_active = ties_active

    def solve(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None = None,
        action: Vector | None = None,
        *,
        data: Mapping[str, Any] | None = None,
    ) -> Solution:
        """Solve Eq. (2) from `state`: V_theta(s), or Q_theta(s, a) with u_0 = `action`.

        Args:
            state: plant state, shape (n,); (x [m], y [m], heading [rad]) for the robot.
            theta: NMPC parameters, shape (2n + m + 1,), or that of a problem's theta.
            warm_start: an earlier solution to start from: as it is if it was solved in this state,
                shifted by one stage if in another. Standing still at `state` if absent.
            action: the first input, shape (m,), within the plant's bounds; free if absent.
            data: of a problem: arrays by name, each of one stage or with an axis of N + 1 in front.

        Raises:
            SolverError: no optimum was found; carries the status, the state and theta.
        """
        began = time.perf_counter()
        state = bounded_vector("state", state, self.n, self.farthest)
        theta = bounded_vector("theta", theta, self.problem.theta.size, self.largest)
        known = self.problem.stage_data(data)
        if min(theta.tolist()) < 0.0 and (theta < self.bending.least).any():
            self.bending.judge(state, theta, known)
        given = FREE
        if action is not None:
            given = action = bounded_vector("action", action, self.m, self._strongest)
            if (action < self.lower).any() or (action > self.upper).any():
                bounds = f"{short(self.lower)} and {short(self.upper)}"
                raise ValueError(f"action {short(action)} must lie between {bounds}")
        if not (warm_start is None or isinstance(warm_start, Solution)):
            raise ValueError(f"warm_start = {warm_start!r} must be a Solution, which solve returns")
        variant = self._free if action is None else self._fixed
        try:
            return variant.solve(Asked(state, theta, warm_start, given, known, began))
        except SolverError as error:
            why, other = variant.diagnosis.why(state, theta, known), ""
            if not isinstance(variant.solver, Compiled):  # which asked fatrop itself
                other = f"try solver={Riccati.name!r}, which begins in more ways"
                box = self.problem.state_lower, self.problem.state_upper
                if not self.problem.soft.all() or np.isfinite(box).any():
                    other += ", and violates hard rows and bounds least where no plan keeps to them"
            said = "; ".join(filter(None, (error.status, why, other)))
            if said == error.status:
                raise
            raise type(error)(said, state, theta) from error

    def solve_many(
        self,
        states: Matrix,
        thetas: Matrix,
        warm_starts: Batch | None = None,
        actions: Matrix | None = None,
        data: Mapping[str, Any] | None = None,
        threads: int | None = None,
    ) -> Batch:
        """Solve from each of B states: what `solve` finds in each, to the last bit, as arrays.

        Nothing is raised where a solve fails: `Batch.status` says so. Threads solve beside each
        other by riccati; CasADi's solvers, which take over where it fails, solve one at a time.

        Args:
            states: shape (B, n).
            thetas: shape (B, d), or (d,) for all.
            warm_starts: an earlier batch of B, of which those that were solved are warm starts.
            actions: first inputs, shape (B, m), or (m,) for all; free if absent.
            data: as in `solve`, for all; an array with an axis of B and one of N + 1 in front
                differs between the problems.
            threads: how many, at least 1; as many as the machine has cores if absent.

        Raises:
            ValueError: a shape is another.
        """
        states = table("states", states, self.n)
        thetas = table("thetas", thetas, self.problem.theta.size, len(states))
        usable = (np.abs(states) <= self.farthest).all(1) & (np.abs(thetas) <= self.largest).all(1)
        if actions is not None:
            actions = table("actions", actions, self.m, len(states))
            usable &= ((actions >= self.lower) & (actions <= self.upper)).all(1)
            usable &= (np.abs(actions) <= self._strongest).all(1)
        known = stage_data(self.problem, data or {}, len(states))
        for k in np.flatnonzero(usable & (thetas < 0).any(1)).tolist():
            if (thetas[k] < self.bending.least).any():
                self.bending.judge(states[k], thetas[k], known[min(k, len(known) - 1)])
        variant = self._free if actions is None else self._fixed
        threads = cpu_count() if threads is None else integer("threads", threads)
        return solve_many(variant, usable, states, thetas, warm_starts, actions, known, threads)

    def value_hessian(self, solution: Solution) -> Matrix:
        """The second derivative of `solution.value` in theta, shape (d, d): see `Sensitivity`."""
        found: Matrix = self._variant(solution).dense(Sensitivity.hessian, solution)
        return found

    def value_hessian_times(self, solution: Solution, vector: Vector) -> Vector:
        """`value_hessian` times a vector of shape (d,); in microseconds by riccati."""
        vector = bounded_vector("vector", vector, solution.theta.size, self.largest)
        product = self._variant(solution).compiled(Compiled.hessian_times, solution, vector)
        return self.value_hessian(solution) @ vector if product is None else product

    def policy_jacobian(self, solution: Solution) -> Matrix:
        """du_0 / dtheta, shape (m, d): how the policy answers to theta; 0 where u_0 is given.

        In microseconds an input by riccati. At a bound or row that is just reached, where the
        policy has a kink, it lies between the derivatives of the two sides; where more is reached
        than the inputs can follow, it is that of the side to which theta grows: see `Sensitivity`.
        """
        variant = self._variant(solution)
        found: Matrix | None = variant.compiled(Compiled.policy, solution)
        if found is None:
            found = variant.dense(Sensitivity.plan, solution)[variant.ocp.inputs[0]]
        return variant.units.inputs[:, None] * found

    def policy_feedback(self, solution: Solution) -> Matrix:
        """du_0 / ds, shape (m, n): how the policy answers to the state; 0 where u_0 is given."""
        variant = self._variant(solution)
        found: Matrix | None = variant.compiled(Compiled.feedback, solution)
        if found is None:
            found = variant.dense(Sensitivity.plan, solution, of=variant.in_state)[
                variant.ocp.inputs[0]
            ]
        return variant.units.inputs[:, None] * found / variant.units.states

    def gradient(
        self,
        solution: Solution | Batch,
        value: Any = 1.0,
        inputs: Any = None,
        states: Any = None,
    ) -> Gradient:
        """The derivatives in state, theta, a given u_0 and data of J, a sum over the solution.

        J = value V + sum_i inputs_i' u_i + sum_i states_i' x_i. Without weights it is V: then
        `state` is dV/ds and `data` dV/dd. With `value` 0 and a single 1 in `inputs` it is an
        entry of the plan: du/ds, du/dtheta and du/dd, at kinks as in `policy_jacobian`. By riccati
        that is one sweep.

        Of a batch of B, weights and derivatives have a first axis of B; its derivatives are 0
        where no optimum was found, and the value's alone where the plan has none.

        Args:
            solution: where, or a batch, for a fourth of the time each.
            value: the weight of the value.
            inputs: the weights of u_0, ..., u_{N-1}, shape (N, m); 0 if absent.
            states: the weights of x_0, ..., x_N, shape (N + 1, n); 0 if absent.

        Raises:
            DerivativeError: the plan has no derivative; V always has one.
        """
        weights = {"inputs": inputs, "states": states}
        if isinstance(solution, Batch):
            variant = self._fixed if solution.ocp.fixed_action.size else self._free
            return variant.gradient([*solution], value, alone=False, **weights)
        weights = {k: None if one is None else np.asarray(one)[None] for k, one in weights.items()}
        found = self._variant(solution).gradient([solution], value, alone=True, **weights)
        data = {name: one[0] for name, one in found.data.items()}
        return Gradient(found.state[0], found.theta[0], found.action[0], data)

    def kkt_residual(self, solution: Solution, *, relative: bool = False) -> float:
        """How far `solution` is from satisfying the KKT conditions: see `Sensitivity`.

        `relative` to the sizes of the plan and of its multipliers, whatever their units.
        """
        variant = self._variant(solution)
        return float(variant.dense(Sensitivity.kkt_residual, solution, relative=relative))

    def clip(self, action: Vector) -> Vector:
        """The nearest action within the bounds, shape (m,)."""
        return np.minimum(np.maximum(action, self.lower), self.upper)

    def compile(self) -> None:
        """Compile solver, derivatives, plant and cost now, and not where they are first used.

        It takes half a minute, once on a machine, and says on standard error what it does and for
        how long: numba's typing takes one half, LLVM the other. CasADi's solvers take no time.
        The loop of `learning` is compiled at the first run or rollout.
        """
        if isinstance(self._free.solver, Compiled):
            _ = self._free.solver.slopes
        if self.plant is not None and self.task is not None:
            still = self.clip(np.zeros(self.m))
            self.task.stage_cost(self.plant.step(self.task.start, still), still)

    def machine(self, *, fix_action: bool) -> Compiled | None:
        """The compiled solver for V(s) or Q(s, a); None as in `Variant.machine`."""
        return (self._fixed if fix_action else self._free).machine

    @property
    def ocp(self) -> Ocp:
        """The problem with u_0 free, in symbols."""
        return self._free.ocp

    def _variant(self, solution: Solution) -> Variant:
        return self._fixed if solution.ocp.fixed_action.size else self._free

    @cached_property
    def bending(self) -> Bending:
        """Warns where a learned weight turns negative."""
        return Bending(self.problem)

    @cached_property
    def _free(self) -> Variant:
        return self._with(fix_action=False)

    @cached_property
    def _fixed(self) -> Variant:
        return self._with(fix_action=True)

    def _with(self, *, fix_action: bool) -> Variant:
        """The problem transcribed, with u_0 free or fixed."""
        ocp = transcribe(self.problem, fix_action=fix_action, ties_active=self.ties_active)
        return Variant(ocp, self.solver)


def bounded_vector(name: str, vector: Vector, size: int, largest: float) -> Vector:
    """A copy of a vector of this size with no number larger."""
    vector = floats(name, vector)
    if vector.shape != (size,):
        raise ValueError(f"{name} has shape {vector.shape}; it must be ({size},)")
    if not math.hypot(*vector) <= largest and not (np.abs(vector) <= largest).all():
        raise ValueError(
            f"{name} {short(vector)} must hold finite numbers of size at most {largest:g}"
        )
    return vector
