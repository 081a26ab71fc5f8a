"""CasADi's solvers on one transcription of the OCP: where warm starts are made and results read."""

import time
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.diagnosis import FARTHEST
from nmpcrl.control.ocp import Ocp, ProblemOcp
from nmpcrl.control.sensitivity import Sensitivity
from nmpcrl.control.solution import Solution, SolverError, check_shape
from nmpcrl.control.solvers.codes import Start
from nmpcrl.control.solvers.solver import LED_ASTRAY, Solver

PrimalDual = tuple[Vector, Vector, Vector]  # z, lam and nu

MAX_ITERATIONS = 300
MAX_SECONDS = 5.0  # fatrop has no clock, but its 300 iterations take about 30 ms


@dataclass(frozen=True)
class Nlpsol(Solver):
    """A solver that CasADi's `nlpsol` calls by its name."""

    starts: ClassVar[dict[Start, dict[str, Any]]]  # the better the start, the less it is moved

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


class Program:
    """An OCP and one of CasADi's solvers."""

    def __init__(self, ocp: Ocp, solver: Nlpsol) -> None:
        self._ocp = ocp
        self._name = solver.name
        self._sensitivity = Sensitivity(ocp)
        self._solvers = {
            start: _function(ocp, solver, options) for start, options in solver.starts.items()
        }
        self._at_start = _start_of(ocp) if isinstance(ocp, ProblemOcp) else None
        self._bounds = {
            "lbx": ca.DM(ocp.lower),
            "ubx": ca.DM(ocp.upper),
            "lbg": ca.DM(np.where(ocp.equality, 0, -np.inf)),
            "ubg": ca.DM.zeros(ocp.equality.size),
        }

    def solve(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None,
        *action: Vector,
        began: float,
        data: Matrix | None = None,
    ) -> Solution:
        """Solve for p = (state, theta[, action]); arguments as in `Nmpc.solve`, already checked."""
        p = np.concatenate([state, theta, *action, *([] if data is None else [data.ravel()])])
        if warm_start is None:
            start, (z, lam, nu) = Start.COLD, self._standing(state)
        else:
            same = np.array_equal(warm_start.state, state)
            start = Start.SAME if same else Start.SHIFTED
            z, lam, nu = self._from(warm_start, state, same=same)
        if self._at_start is not None and not np.isfinite(self._at_start(z, p).full()).all():
            raise SolverError(
                f"{self._name} cannot begin where a number is not finite", state, theta
            )
        solver = self._solvers[start]
        result = solver(p=p, x0=z, lam_g0=lam, lam_x0=nu, **self._bounds)
        stats = solver.stats()
        z, lam, nu = (result[key].full().ravel() for key in ("x", "lam_g", "lam_x"))
        if not (stats["success"] and np.isfinite([z.sum(), lam.sum(), nu.sum()]).all()):
            raise SolverError(_status(self._name, stats), state, theta)
        if np.abs(z[self._ocp.states]).max() > FARTHEST:
            raise SolverError(f"{self._name} {LED_ASTRAY}", state, theta)
        z = np.clip(z, self._ocp.lower, self._ocp.upper)  # fatrop relaxes bounds by 1e-8
        self._settle_stage_zero(lam, nu, p)
        value, features = self._sensitivity.value_and_gradient(z, p, lam)
        return Solution(
            state=state,
            theta=theta,
            value=value,
            features=features,
            iterations=int(stats["iter_count"]),
            seconds=time.perf_counter() - began,
            point=np.concatenate([z, lam, nu]),
            ocp=self._ocp,
            solver=self._name,
            data=data,
        )

    def hessian_times(self, solution: Solution, vector: Vector) -> None:
        """None: CasADi's solvers have the dense Hessian only."""

    def plan_gradient(self, solution: Solution, states: Matrix, inputs: Matrix) -> None:
        """None, as well."""

    def _standing(self, state: Vector) -> PrimalDual:
        """Stay at `state` for the whole horizon; slacks take up what overlaps there."""
        ocp = self._ocp
        z = np.zeros(ocp.lower.size)
        z[ocp.states] = state
        return z, np.zeros(ocp.equality.size), np.zeros(ocp.lower.size)

    def _from(self, warm_start: Solution, state: Vector, *, same: bool) -> PrimalDual:
        """The warm start itself if solved in the same state; else one stage later, its end twice.

        Shifting divides every stage's discount by gamma, and with it the multipliers.
        """
        ocp, old = self._ocp, warm_start.ocp
        check_shape(warm_start, ocp)
        z, nu = np.zeros(ocp.lower.size), np.zeros(ocp.lower.size)
        lam = np.zeros(ocp.equality.size)
        scale = 1.0 if same else 1.0 / ocp.gamma
        for part in ("states", "inputs", "slacks"):
            here, there = getattr(ocp, part), _shift(getattr(old, part), same)
            z[here], nu[here] = warm_start.primal[there], scale * warm_start.bound_duals[there]
        for part in ("dynamics", "obstacles"):
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
        weights = np.broadcast_to(self._ocp.slack_weights, self._ocp.slacks.shape[1:])[which]
        inside = beyond > ties
        lam[self._ocp.obstacles[0][which]] = np.where(inside, weights, 0.0)
        nu[self._ocp.slacks[0][which]] = np.where(inside, 0.0, -weights)


def _start_of(ocp: Ocp) -> ca.Function:
    """What must be finite, or fatrop never returns: objective, its slope, and constraints."""
    z, f = ocp.variables, ocp.objective
    return ca.Function(
        "start", [z, ocp.parameters], [ca.veccat(f, ca.gradient(f, z), ocp.constraints)]
    )


def _function(ocp: Ocp, solver: Nlpsol, start: dict[str, Any]) -> ca.Function:
    nlp = {"x": ocp.variables, "p": ocp.parameters, "f": ocp.objective, "g": ocp.constraints}
    settings: dict[str, Any] = {"print_time": False, solver.name: solver.options | start}
    return ca.nlpsol(solver.name, solver.name, nlp, settings | solver.structure(ocp))


def _status(name: str, stats: dict[str, Any]) -> str:
    said = stats["return_status"]
    iterations = stats["iter_count"]
    return f"{name} found no optimum in {iterations} iterations (its status: {said})"


def _shift(indices: np.ndarray, same: bool) -> np.ndarray:
    return indices if same else np.concatenate([indices[1:], indices[-1:]])
