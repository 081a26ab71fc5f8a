"""CasADi's solvers on one transcription of the OCP.

A `Problem` is solved in units in which no slack costs more than `HIGHEST_PRICE`, no curvature of
the cost is below 1 and rows are of size 1, for tolerances are absolute. Cold starts lie a little
off rest, where symmetry may make a maximum stationary. A solve that fails begins again, with Ipopt
as well. A plan that is no strict minimum is compared with plans from other starts.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from nmpcrl import Vector
from nmpcrl.control.diagnosis import FARTHEST
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.sensitivity import Sensitivity
from nmpcrl.control.solution import Solution, SolverError, check_shape
from nmpcrl.control.solvers.codes import Start
from nmpcrl.control.solvers.solver import LED_ASTRAY, Asked, Solver
from nmpcrl.control.solvers.starts import random_inputs

PrimalDual = tuple[Vector, Vector, Vector]  # z, lam and nu

MAX_ITERATIONS = 300
MAX_SECONDS = 5.0  # of the processor; fatrop has no clock
HIGHEST_PRICE = 100.0  # of a slack, as in the paper: above it the slack's unit becomes smaller
OFF_REST = 1e-3  # where a cold solve of a `Problem` begins, in parts of the bounds
ELSEWHERE = 2  # starts that are compared with a plan that is no strict minimum
CLEARLY = 1e-6  # another plan is better if its value is less by this share


@dataclass(frozen=True)
class Nlpsol(Solver):
    """A solver that CasADi's `nlpsol` calls by its name."""

    others: ClassVar[tuple[type["Nlpsol"], ...]] = ()  #: tried in turn where this one finds no plan
    starts: ClassVar[dict[Start, dict[str, Any]]]  #: options of warm starts, stay near them

    @property
    def options(self) -> dict[str, Any]:
        """The solver's own options, whatever the start: silent, and bounded."""
        return {"print_level": 0, "tol": self.tolerance, "max_iter": MAX_ITERATIONS}

    def structure(self, ocp: Ocp) -> dict[str, Any]:
        """Options of `nlpsol` that describe the problem's structure."""
        return {}

    def prepare(self, ocp: Ocp) -> "Program":
        """An NLP solver for each kind of start."""
        return Program(ocp, self)


NEAR = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")


@dataclass(frozen=True)
class Ipopt(Nlpsol):
    """Ipopt, the paper's solver: an interior point for any NLP."""

    name: ClassVar[str] = "ipopt"
    starts: ClassVar[dict[Start, dict[str, Any]]] = dict.fromkeys(
        (Start.SHIFTED, Start.SAME),
        {"warm_start_init_point": "yes", "mu_init": 1e-3}
        | dict.fromkeys((f"warm_start_{name}" for name in NEAR), 1e-4),
    )

    @property
    def options(self) -> dict[str, Any]:
        """Bounded in time, too."""
        own = {"sb": "yes", "max_cpu_time": MAX_SECONDS, "bound_relax_factor": 0.0}
        return super().options | own


@dataclass(frozen=True)
class Fatrop(Nlpsol):
    """fatrop: an interior point that works stage by stage, the fastest of CasADi's here.

    Version 1.1.8 may never return where all plans lead to enormous states; riccati and Ipopt do.
    """

    name: ClassVar[str] = "fatrop"
    others: ClassVar[tuple[type[Nlpsol], ...]] = (Ipopt,)  #: slower and sturdier
    starts: ClassVar[dict[Start, dict[str, Any]]] = {
        Start.SHIFTED: {"bound_push": 1e-3},
        Start.SAME: {"mu_init": 1e-4, "bound_push": 1e-6},
    }

    def structure(self, ocp: Ocp) -> dict[str, Any]:
        """fatrop finds the stages itself."""
        return {"structure_detection": "auto", "equality": ocp.equality.tolist()}


class Program:
    """An OCP and one of CasADi's solvers."""

    def __init__(self, ocp: Ocp, solver: Nlpsol) -> None:
        self._ocp, self._solver = ocp, solver
        self._problem = ocp.problem
        self._sensitivity = Sensitivity(ocp)
        self._factor, self._rows = min(1.0, ocp.problem.cost_scale), ocp.sizes[1]  # units of f, g
        self._units = np.ones(ocp.lower.size)  # of z
        price = HIGHEST_PRICE * self._factor / ocp.slack_weights
        self._units[ocp.slacks] = np.minimum(1.0, price)
        z, f, g = ocp.variables, ocp.objective, ocp.constraints
        finite = ca.veccat(f, ca.gradient(f, z), g)  # at the start, or fatrop never returns
        self._at_start = ca.Function("start", [z, ocp.parameters], [finite])
        self._bounds = {
            "lbx": ca.DM(ocp.lower / self._units),
            "ubx": ca.DM(ocp.upper / self._units),
            "lbg": ca.DM(np.where(ocp.equality, 0, -np.inf)),
            "ubg": ca.DM.zeros(ocp.equality.size),
        }
        self._function = cache(self._written)
        for start in (Start.COLD, *solver.starts):
            self._function(solver, start)

    def solve(self, asked: Asked) -> Solution:
        """See `Prepared.solve`."""
        state, theta, warm_start, action, data, began = asked
        p = np.concatenate([state, theta, action, data.ravel()])
        failed: list[str] = []
        for solver, start, point in self._starts(warm_start, state):
            found = self._attempt(solver, start, point, p, asked)
            if isinstance(found, Solution):
                break
            failed.append(found)
        else:
            raise SolverError("; ".join(failed), state, theta)
        restarts, best = len(failed), found
        if not self._sensitivity.is_minimum(
            found.primal, p, found.constraint_duals, found.bound_duals
        ):
            for seed in range(ELSEWHERE):
                drawn = self._standing(state, seed, share=1.0)
                other = self._attempt(self._solver, Start.COLD, drawn, p, asked)
                least = found.value - CLEARLY * abs(found.value)
                if isinstance(other, Solution) and other.value < least:
                    restarts, best = restarts + seed + 1, other
                    break
        return replace(
            best,
            seconds=time.perf_counter() - began,
            restarts=restarts,
            took_over=best.solver != self._solver.name,
        )

    def _starts(
        self, warm_start: Solution | None, state: Vector
    ) -> Iterator[tuple[Nlpsol, Start, PrimalDual]]:
        """The warm start, then a cold start, then cold starts of other solvers."""
        if warm_start is not None:
            same = np.array_equal(warm_start.state, state)
            start = Start.SAME if same else Start.SHIFTED
            z, lam, nu = reorder(warm_start, self._ocp, shift=not same)
            z[self._ocp.states[0]] = state
            nu[np.isinf(self._ocp.lower) & np.isinf(self._ocp.upper)] = (
                0  # as fatrop was given them
            )
            yield self._solver, start, (z, lam, nu)
        others = (kind(self._solver.tolerance) for kind in self._solver.others)
        for solver in (self._solver, *others):
            yield solver, Start.COLD, self._standing(state)

    def _attempt(
        self, solver: Nlpsol, start: Start, point: PrimalDual, p: Vector, asked: Asked
    ) -> Solution | str:
        """An optimum, or why there is none."""
        ocp, factor, units, rows = self._ocp, self._factor, self._units, self._rows
        z, lam, nu = point
        if not np.isfinite(self._at_start(z, p).full()).all():
            return f"{solver.name} cannot begin where a number is not finite"
        function = self._function(solver, start)
        result = function(
            p=p,
            x0=z / units,
            lam_g0=lam * rows / factor,
            lam_x0=nu * units / factor,
            **self._bounds,
        )
        stats = function.stats()
        z, lam, nu = (result[key].full().ravel() for key in ("x", "lam_g", "lam_x"))
        if not (stats["success"] and np.isfinite([z.sum(), lam.sum(), nu.sum()]).all()):
            took, said = stats["iter_count"], stats["return_status"]
            return f"{solver.name} found no optimum in {took} iterations (its status: {said})"
        z, lam, nu = z * units, lam * factor / rows, nu * factor / units
        if np.abs(z[ocp.states]).max() > FARTHEST:
            return f"{solver.name} {LED_ASTRAY}"
        z = np.clip(z, ocp.lower, ocp.upper)  # fatrop relaxes bounds by 1e-8
        self._settle_stage_zero(lam, nu, p)
        value, features = self._sensitivity.value_and_gradient(z, p, lam)
        return Solution(
            asked.state, asked.theta, value.item(), features.ravel(), int(stats["iter_count"]), 0.0,
            np.concatenate([z, lam, nu]), ocp, solver.name, asked.data,
        )  # fmt: skip

    def _written(self, solver: Nlpsol, start: Start) -> ca.Function:
        """`nlpsol` with objective, variables and constraints in their units."""
        ocp, factor = self._ocp, self._factor
        z, f, g = ocp.variables, ocp.objective, ocp.constraints
        scaled = [f / factor, g / ca.DM(self._rows)]
        f, g = ca.substitute(scaled, [z], [ca.DM(self._units) * z])
        nlp = {"x": z, "p": ocp.parameters, "f": f, "g": g}
        settings: dict[str, Any] = {
            "print_time": False,
            solver.name: solver.options | solver.starts.get(start, {}),
        }
        return ca.nlpsol(solver.name, solver.name, nlp, settings | solver.structure(ocp))

    def _standing(self, state: Vector, seed: int = 0, *, share: float = OFF_REST) -> PrimalDual:
        """Every stage at `state`, without slacks; inputs at rest plus this share of drawn ones."""
        ocp, problem = self._ocp, self._problem
        z = np.zeros(ocp.lower.size)
        z[ocp.states] = state
        rest = np.clip(0.0, problem.lower, problem.upper)
        z[ocp.inputs] = rest + share * (random_inputs(problem, seed, len(ocp.inputs)) - rest)
        return z, np.zeros(ocp.equality.size), np.zeros(ocp.lower.size)

    def _settle_stage_zero(self, lam: Vector, nu: Vector, p: Vector) -> None:
        """Choose the multipliers of the slacks of x_0 = s, which are not unique on a boundary.

        Nothing can be planned about x_0, so sigma_0 = max(0, Xi(s) + theta_c): its derivative in
        theta_c is omega inside an obstacle and 0 outside. On the boundary any number in between
        satisfies KKT and each solver returns another; here it is 0.  # departure L
        """
        which, beyond, ties = self._ocp.settled(p)
        weights = self._ocp.slack_weights[which]
        inside = beyond > ties
        lam[self._ocp.obstacles[0][which]] = np.where(inside, weights, 0.0)
        nu[self._ocp.slacks[0][which]] = np.where(inside, 0.0, -weights)


def reorder(warm_start: Solution, ocp: Ocp, *, shift: bool = False) -> PrimalDual:
    """z, lam and nu of a solution in the order of an OCP; a `shift` is one stage, the end repeated.

    Shifting divides every stage's discount by gamma, and with it the multipliers.

    Raises:
        ValueError: the solution has another horizon, plant or number of obstacles.
    """
    check_shape(warm_start, ocp)
    old, scale = warm_start.ocp, 1.0 / ocp.problem.gamma if shift else 1.0

    def source(part: str) -> np.ndarray:
        places: np.ndarray = getattr(old, part)
        return np.concatenate([places[1:], places[-1:]]) if shift else places

    z, nu = np.zeros(ocp.lower.size), np.zeros(ocp.lower.size)
    lam = np.zeros(ocp.equality.size)
    for part in ("states", "inputs", "slacks"):
        here, there = getattr(ocp, part), source(part)
        z[here], nu[here] = warm_start.primal[there], scale * warm_start.bound_duals[there]
    for part in ("dynamics", "obstacles", "hard"):
        lam[getattr(ocp, part)] = scale * warm_start.constraint_duals[source(part)]
    incoming = old.dynamics[0] if shift else old.initial
    lam[ocp.initial] = scale * warm_start.constraint_duals[incoming]
    return z, lam, nu
