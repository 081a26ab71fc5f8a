"""CasADi's solvers on one transcription of the OCP: where warm starts are made and results read.

A `Problem` is solved in units in which no slack costs more than `HIGHEST_PRICE`, no curvature of
the cost is below 1 and rows are of size 1, for tolerances are absolute. Its cold starts lie a
little off rest, where symmetry may make a maximum stationary. A solve that fails begins again, with
Ipopt as well. One that ends at no strict minimum is compared with solves from elsewhere: see
`Solution.restarts` and `Solution.solver`.
"""

import time
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, NamedTuple

import casadi as ca
import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.diagnosis import FARTHEST
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.sensitivity import Sensitivity
from nmpcrl.control.solution import Solution, SolverError, check_shape
from nmpcrl.control.solvers.codes import Start
from nmpcrl.control.solvers.solver import LED_ASTRAY, Solver
from nmpcrl.control.solvers.starts import random_inputs

PrimalDual = tuple[Vector, Vector, Vector]  # z, lam and nu

MAX_ITERATIONS = 300
MAX_SECONDS = 5.0  # fatrop has no clock, but its 300 iterations take about 30 ms
HIGHEST_PRICE = (
    100.0  # the price of a slack, above which its unit becomes smaller; that of the paper
)
OFF_REST = 1e-3  # where a cold solve of a `Problem` begins, in parts of the bounds
ELSEWHERE = 2  # starts that are compared with a plan that is no strict minimum
CLEARLY = 1e-6  # another plan is better if its value is less by this share


@dataclass(frozen=True)
class Nlpsol(Solver):
    """A solver that CasADi's `nlpsol` calls by its name."""

    starts: ClassVar[dict[Start, dict[str, Any]]]  # the better the start, the less it is moved

    @property
    def others(self) -> tuple["Nlpsol", ...]:
        """Those that take over where this one finds no plan of a `Problem`."""
        return ()

    @property
    @abstractmethod
    def options(self) -> dict[str, Any]:
        """The solver's own options, whatever the start."""

    def structure(self, ocp: Ocp) -> dict[str, Any]:
        """Options of `nlpsol` that describe the problem's structure."""
        return {}

    def prepare(self, ocp: Ocp) -> "Program":
        """An NLP solver for each kind of start."""
        return Program(ocp, self)


@dataclass(frozen=True)
class Fatrop(Nlpsol):
    """fatrop: an interior point that follows the stages, as fast as CasADi's get here."""

    name: ClassVar[str] = "fatrop"
    starts: ClassVar[dict[Start, dict[str, Any]]] = {
        Start.COLD: {},
        Start.SHIFTED: {"bound_push": 1e-3},
        Start.SAME: {"mu_init": 1e-4, "bound_push": 1e-6},
    }

    @property
    def others(self) -> tuple[Nlpsol, ...]:
        """Ipopt, slower and sturdier."""
        return (Ipopt(self.tolerance),)

    @property
    def options(self) -> dict[str, Any]:
        """Silent, and bounded."""
        return {"print_level": 0, "tol": self.tolerance, "max_iter": MAX_ITERATIONS}

    def structure(self, ocp: Ocp) -> dict[str, Any]:
        """Stages are found by fatrop itself."""
        return {"structure_detection": "auto", "equality": ocp.equality.tolist()}


_NEAR = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
_WARM_IPOPT = {
    "warm_start_init_point": "yes",
    "mu_init": 1e-3,
    **{f"warm_start_{name}": 1e-4 for name in _NEAR},
}


@dataclass(frozen=True)
class Ipopt(Nlpsol):
    """Ipopt: the paper's solver, for any NLP."""

    name: ClassVar[str] = "ipopt"
    starts: ClassVar[dict[Start, dict[str, Any]]] = {
        Start.COLD: {},
        Start.SHIFTED: _WARM_IPOPT,
        Start.SAME: _WARM_IPOPT,
    }

    @property
    def options(self) -> dict[str, Any]:
        """Silent, and bounded in iterations and time."""
        return {
            "print_level": 0,
            "sb": "yes",
            "tol": self.tolerance,
            "max_iter": MAX_ITERATIONS,
            "max_wall_time": MAX_SECONDS,
            "bound_relax_factor": 0.0,
        }


class Found(NamedTuple):
    """What one start led to."""

    z: Vector
    lam: Vector
    nu: Vector
    iterations: int
    solver: str
    value: float
    features: Vector


class Program:
    """An OCP and one of CasADi's solvers."""

    def __init__(self, ocp: Ocp, solver: Nlpsol) -> None:
        self._ocp, self._solver = ocp, solver
        self._problem = ocp.problem
        self._sensitivity = Sensitivity(ocp)
        self._factor, self._units, self._rows = _scales(ocp)
        self._at_start = _start_of(ocp)
        self._bounds = {
            "lbx": ca.DM(ocp.lower / self._units),
            "ubx": ca.DM(ocp.upper / self._units),
            "lbg": ca.DM(np.where(ocp.equality, 0, -np.inf)),
            "ubg": ca.DM.zeros(ocp.equality.size),
        }
        self._function = cache(self._written)
        for start in solver.starts:
            self._function(solver, start)

    def solve(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None,
        *action: Vector,
        began: float,
        data: Matrix,
    ) -> Solution:
        """Solve for p = (state, theta[, action]); arguments as in `Nmpc.solve`, already checked."""
        p = np.concatenate([state, theta, *action, data.ravel()])
        failed: list[str] = []
        for solver, start, point in self._starts(warm_start, state):
            found = self._attempt(solver, start, point, p)
            if isinstance(found, Found):
                break
            failed.append(found)
        else:
            raise SolverError("; ".join(failed), state, theta)
        restarts, best = len(failed), found
        if not self._sensitivity.is_minimum(found.z, p, found.lam, found.nu):
            restarts, best = self._elsewhere(found, state, p, restarts)
        return Solution(
            state=state,
            theta=theta,
            value=best.value,
            features=best.features,
            iterations=best.iterations,
            seconds=time.perf_counter() - began,
            point=np.concatenate(best[:3]),
            ocp=self._ocp,
            solver=best.solver,
            restarts=restarts,
            data=data,
            took_over=best.solver != self._solver.name,
        )

    def _starts(
        self, warm_start: Solution | None, state: Vector
    ) -> Iterator[tuple[Nlpsol, Start, PrimalDual]]:
        """The warm start, and then a cold one, by others as well."""
        if warm_start is not None:
            same = np.array_equal(warm_start.state, state)
            start = Start.SAME if same else Start.SHIFTED
            yield self._solver, start, self._from(warm_start, state, same=same)
        for solver in (self._solver, *self._solver.others):
            yield solver, Start.COLD, self._standing(state)

    def _attempt(self, solver: Nlpsol, start: Start, point: PrimalDual, p: Vector) -> Found | str:
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
            return _status(solver.name, stats)
        z, lam, nu = z * units, lam * factor / rows, nu * factor / units
        if np.abs(z[ocp.states]).max() > FARTHEST:
            return f"{solver.name} {LED_ASTRAY}"
        z = np.clip(z, ocp.lower, ocp.upper)  # fatrop relaxes bounds by 1e-8
        self._settle_stage_zero(lam, nu, p)
        value, features = self._sensitivity.value_and_gradient(z, p, lam)
        return Found(z, lam, nu, int(stats["iter_count"]), solver.name, value, features)

    def _elsewhere(
        self, found: Found, state: Vector, p: Vector, restarts: int
    ) -> tuple[int, Found]:
        """A plan from drawn inputs if it is clearly better, and how often a solve has begun."""
        for seed in range(ELSEWHERE):
            start = self._standing(state, seed, share=1.0)
            other = self._attempt(self._solver, Start.COLD, start, p)
            least = found.value - CLEARLY * abs(found.value)
            if isinstance(other, Found) and other.value < least:
                return restarts + seed + 1, other
        return restarts, found

    def _written(self, solver: Nlpsol, start: Start) -> ca.Function:
        """`nlpsol` with the objective in parts of its factor, and variables in their units."""
        ocp, factor = self._ocp, self._factor
        z, f, g = ocp.variables, ocp.objective, ocp.constraints
        if factor != 1 or (self._units != 1).any() or (self._rows != 1).any():
            scaled = [f / factor, g / ca.DM(self._rows)]
            f, g = ca.substitute(scaled, [z], [ca.DM(self._units) * z])
        nlp = {"x": z, "p": ocp.parameters, "f": f, "g": g}
        settings: dict[str, Any] = {
            "print_time": False,
            solver.name: solver.options | solver.starts[start],
        }
        return ca.nlpsol(solver.name, solver.name, nlp, settings | solver.structure(ocp))

    def _standing(self, state: Vector, seed: int = 0, *, share: float = OFF_REST) -> PrimalDual:
        """Stay at `state` for the whole horizon; slacks take up what overlaps there.

        A problem's inputs are this share of drawn ones.
        """
        ocp, problem = self._ocp, self._problem
        z = np.zeros(ocp.lower.size)
        z[ocp.states] = state
        rest = np.clip(0.0, problem.lower, problem.upper)
        z[ocp.inputs] = rest + share * (random_inputs(problem, seed, len(ocp.inputs)) - rest)
        return z, np.zeros(ocp.equality.size), np.zeros(ocp.lower.size)

    def _from(self, warm_start: Solution, state: Vector, *, same: bool) -> PrimalDual:
        """The warm start itself if solved in the same state; else one stage later, its end twice.

        Shifting divides every stage's discount by gamma, and with it the multipliers.
        """
        ocp, old = self._ocp, warm_start.ocp
        check_shape(warm_start, ocp)
        z, nu = np.zeros(ocp.lower.size), np.zeros(ocp.lower.size)
        lam = np.zeros(ocp.equality.size)
        scale = 1.0 if same else 1.0 / ocp.problem.gamma
        for part in ("states", "inputs", "slacks"):
            here, there = getattr(ocp, part), _shift(getattr(old, part), same)
            z[here], nu[here] = warm_start.primal[there], scale * warm_start.bound_duals[there]
        for part in ("dynamics", "obstacles", "hard"):
            here, there = getattr(ocp, part), _shift(getattr(old, part), same)
            lam[here] = scale * warm_start.constraint_duals[there]
        incoming = old.initial if same else old.dynamics[0]
        lam[ocp.initial] = scale * warm_start.constraint_duals[incoming]
        z[ocp.states[0]] = state
        nu[np.isinf(ocp.lower) & np.isinf(ocp.upper)] = 0  # fatrop hands these back as they came
        return z, lam, nu

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


def _start_of(ocp: Ocp) -> ca.Function:
    """What must be finite, or fatrop never returns: objective, its slope, and constraints."""
    z, f = ocp.variables, ocp.objective
    return ca.Function(
        "start", [z, ocp.parameters], [ca.veccat(f, ca.gradient(f, z), ocp.constraints)]
    )


def _scales(ocp: Ocp) -> tuple[float, Vector, Vector]:
    """What the objective is divided by, the units of z, and those of the constraints."""
    factor = min(1.0, ocp.problem.cost_scale)
    units = np.ones(ocp.lower.size)
    units[ocp.slacks] = np.minimum(1.0, HIGHEST_PRICE * factor / ocp.slack_weights)
    return factor, units, ocp.sizes[1]


def _status(name: str, stats: dict[str, Any]) -> str:
    said = stats["return_status"]
    iterations = stats["iter_count"]
    return f"{name} found no optimum in {iterations} iterations (its status: {said})"


def _shift(indices: np.ndarray, same: bool) -> np.ndarray:
    return indices if same else np.concatenate([indices[1:], indices[-1:]])
