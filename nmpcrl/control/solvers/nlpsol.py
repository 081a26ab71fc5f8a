"""One transcription of the OCP and a solver of CasADi: where guesses are made and results read."""

import time
from typing import Any

import casadi as ca
import numpy as np

from nmpcrl import Vector
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.sensitivity import Sensitivity
from nmpcrl.control.solution import Solution, SolverError, check_shape
from nmpcrl.control.task import Task

TOLERANCE = 1e-8  # of the solvers, on their own scaled KKT residual
MAX_ITERATIONS = 300
MAX_SECONDS = 5.0  # fatrop has no clock, but its 300 iterations take about 30 ms
TIE = 1e-6  # a start this close to an obstacle's boundary is on it, not in it  # departure L

SOLVERS: dict[str, dict[str, Any]] = {
    "fatrop": {"print_level": 0, "tol": TOLERANCE, "max_iter": MAX_ITERATIONS},
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "tol": TOLERANCE,
        "max_iter": MAX_ITERATIONS,
        "max_wall_time": MAX_SECONDS,
        "bound_relax_factor": 0.0,
    },
}


_NEAR = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
_WARM_IPOPT = {
    "warm_start_init_point": "yes",
    "mu_init": 1e-3,
    **{f"warm_start_{name}": 1e-4 for name in _NEAR},
}
STARTS: dict[str, dict[str, dict[str, Any]]] = {  # the better the start, the less it is moved
    "fatrop": {
        "standing": {},
        "shifted": {"bound_push": 1e-3},
        "same": {"mu_init": 1e-4, "bound_push": 1e-6},
    },
    "ipopt": {
        "standing": {},
        "shifted": _WARM_IPOPT,
        "same": _WARM_IPOPT,
    },
}


class Program:
    """An OCP and one of CasADi's solvers."""

    def __init__(
        self,
        ocp: Ocp,
        sensitivity: Sensitivity,
        task: Task,
        solver: str,
        *,
        ties_active: bool = False,
        tolerance: float = TOLERANCE,
    ) -> None:
        """Make the solver; the options are those of `Nmpc`."""
        self._ocp = ocp
        self._tie = -TIE if ties_active else TIE
        self._sensitivity = sensitivity
        self._task = task
        self._name = solver
        self._solvers = {
            start: _solver(ocp, solver, SOLVERS[solver] | options | {"tol": tolerance})
            for start, options in STARTS[solver].items()
        }
        self._bounds = {
            "lbx": ca.DM(ocp.lower),
            "ubx": ca.DM(ocp.upper),
            "lbg": ca.DM(np.where(ocp.equality, 0, -np.inf)),
            "ubg": ca.DM.zeros(ocp.equality.size),
        }

    def solve(
        self, state: Vector, theta: Vector, guess: Solution | None, *action: Vector, began: float
    ) -> Solution:
        """Solve for p = (state, theta[, action]); arguments as in `Nmpc.solve`, already checked."""
        p = np.concatenate([state, theta, *action])
        if guess is None:
            start, (z, lam, nu) = "standing", self._standing(state)
        else:
            start = "same" if np.array_equal(guess.state, state) else "shifted"
            z, lam, nu = self._from(guess, state, same=start == "same")
        solver = self._solvers[start]
        result = solver(p=p, x0=z, lam_g0=lam, lam_x0=nu, **self._bounds)
        stats = solver.stats()
        z, lam, nu = (result[key].full().ravel() for key in ("x", "lam_g", "lam_x"))
        if not (stats["success"] and np.isfinite([z.sum(), lam.sum(), nu.sum()]).all()):
            raise SolverError(_status(self._name, stats), state, theta)
        z = np.clip(z, self._ocp.lower, self._ocp.upper)  # fatrop relaxes bounds by 1e-8
        self._settle_stage_zero(lam, nu, state, theta)
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
        )

    def _standing(self, state: Vector) -> tuple[Vector, Vector, Vector]:
        """Stay at `state` for the whole horizon; slacks take up what overlaps there."""
        ocp = self._ocp
        z = np.zeros(ocp.lower.size)
        z[ocp.states] = state
        return z, np.zeros(ocp.equality.size), np.zeros(ocp.lower.size)

    def _from(self, guess: Solution, state: Vector, *, same: bool) -> tuple[Vector, Vector, Vector]:
        """The guess itself if it was solved in the same state; else one stage later, its end twice.

        Shifting divides every stage's discount by gamma, and with it the multipliers.
        """
        ocp, old = self._ocp, guess.ocp
        check_shape(guess, ocp)
        z, nu = np.zeros(ocp.lower.size), np.zeros(ocp.lower.size)
        lam = np.zeros(ocp.equality.size)
        scale = 1.0 if same else 1.0 / ocp.gamma
        for part in ("states", "inputs", "slacks"):
            here, there = getattr(ocp, part), _shift(getattr(old, part), same)
            z[here], nu[here] = guess.primal[there], scale * guess.bound_duals[there]
        for part in ("dynamics", "obstacles"):
            here, there = getattr(ocp, part), _shift(getattr(old, part), same)
            lam[here] = scale * guess.constraint_duals[there]
        incoming = old.initial if same else old.dynamics[0]
        lam[ocp.initial] = scale * guess.constraint_duals[incoming]
        z[ocp.states[0]] = state
        nu[np.isinf(ocp.lower) & np.isinf(ocp.upper)] = 0  # fatrop hands these back as they came
        return z, lam, nu

    def _settle_stage_zero(self, lam: Vector, nu: Vector, state: Vector, theta: Vector) -> None:
        """Choose the multipliers of the slacks of x_0 = s, which are not unique on a boundary.

        Nothing can be planned about x_0, so sigma_0 = max(0, Xi(s) + theta_c): its derivative in
        theta_c is omega inside an obstacle and 0 outside. On the boundary any number in between
        satisfies KKT and each solver returns another; here it is 0.  # departure L
        """
        inside = self._task.overlap(state) + theta[-1] > self._tie
        lam[self._ocp.obstacles[0]] = np.where(inside, self._ocp.slack_weight, 0.0)
        nu[self._ocp.slacks[0]] = np.where(inside, 0.0, -self._ocp.slack_weight)


def _solver(ocp: Ocp, name: str, options: dict[str, Any]) -> ca.Function:
    nlp = {"x": ocp.variables, "p": ocp.parameters, "f": ocp.objective, "g": ocp.constraints}
    settings: dict[str, Any] = {"print_time": False, name: options}
    if name == "fatrop":
        settings |= {"structure_detection": "auto", "equality": ocp.equality.tolist()}
    return ca.nlpsol(name, name, nlp, settings)


def _status(name: str, stats: dict[str, Any]) -> str:
    said = stats["return_status"]
    iterations = stats["iter_count"]
    return f"{name} found no optimum in {iterations} iterations (its status: {said})"


def _shift(indices: np.ndarray, same: bool) -> np.ndarray:
    return indices if same else np.concatenate([indices[1:], indices[-1:]])
