"""A sweep: riccati on very many drawn problems, each checked, and Ipopt on every fourth.

Layouts, states, theta and actions are drawn from where a run may take them: four obstacles and the
state anywhere in the box, the eight weights of theta log-uniform, so that some are all but zero.
"""

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.bench import sealed
from nmpcrl.control import Nmpc, Plant, Riccati, Solution, SolverError
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.files import check_folder, folder
from nmpcrl.study.jobs import parallel
from nmpcrl.study.limits import need_numba
from nmpcrl.study.parameters import whole
from nmpcrl.study.refusal import Refusal
from nmpcrl.study.setup import compile_ahead

SEED = 2025
PROBLEMS = whole(1, 10**9)  # that a sweep may have
OF_A_LAYOUT = 400  # problems: a layout is transcribed anew
COMPARED = 4  # every so many problems are given to Ipopt, too, which takes most of the time
OBSTACLES = 4
WITH_ACTION = 0.3  # share of the problems that are Q(s, a), with u_0 = a fixed
WEIGHTS = (0.01, 10.0)  # of theta, log-uniform; `paper.THETA_SET` begins at 0
TIGHTENED = (0.0, 1.0)  # theta_c, uniform: at 1 a circle has 1.4 times its diameter
KEPT = 1e-6  # [m]; a plan that leaves the box by more has no KKT conditions with a hard box
SAME = 1e-6  # relative difference of two values that are the same minimum's


class DamagedSweep(Refusal):
    """A file is not a sweep's table."""


@dataclass(frozen=True)
class Tally:
    """How so many problems went; tallies add up."""

    tried: int = 0
    with_action: int = 0
    at_once: int = 0
    restarted: int = 0  # solved, but not from the first start
    failed: int = 0  # with a SolverError
    outside: int = 0  # solved, but no plan keeps to the box
    broken: int = 0  # an input out of bounds, or a number that is not finite
    kkt: float = 0.0  # the largest residual of a solution in the box: `Nmpc.kkt_residual`
    better: int = 0  # than Ipopt's minimum
    equal: int = 0
    worse: int = 0
    ipopt_failed: int = 0

    def __add__(self, other: "Tally") -> "Tally":
        ours, theirs = asdict(self), asdict(other)
        summed = {name: ours[name] + theirs[name] for name in ours}
        return Tally(**summed | {"kkt": float(np.maximum(self.kkt, other.kkt))})


@dataclass(frozen=True)
class SweepTable:
    """What a sweep found; `print` shows it."""

    tally: Tally
    about: dict[str, Any]  # seed, date, seconds, machine and versions

    def rows(self) -> list[tuple[str, str]]:
        """What was counted, and how often."""
        t, count = self.tally, "{:,}".format
        compared = t.better + t.equal + t.worse + t.ipopt_failed
        return [
            ("problems tried", count(t.tried)),
            ("of them with u_0 = a fixed", count(t.with_action)),
            ("solved at once", count(t.at_once)),
            ("solved after a restart", count(t.restarted)),
            ("given up with a SolverError", count(t.failed)),
            ("plans that leave the box", count(t.outside)),
            ("inputs out of bounds, or numbers not finite", count(t.broken)),
            ("largest KKT residual in the box", f"{t.kkt:.1e}"),
            ("compared with Ipopt", count(compared)),
            ("a better minimum than Ipopt's", count(t.better)),
            ("the same minimum", count(t.equal)),
            ("a worse minimum than Ipopt's", count(t.worse)),
            ("not solved by Ipopt", count(t.ipopt_failed)),
        ]

    def __str__(self) -> str:
        rows = self.rows()
        name, count = (max(map(len, column)) for column in zip(*rows, strict=True))
        return "\n".join(f"{label:{name}}  {value:>{count}}" for label, value in rows)


def sweep(problems: int, *, workers: int | None = None, progress: bool = True) -> SweepTable:
    """Draw and solve so many problems, and keep what was counted in `path`.

    The same problems are drawn every time: of a longer sweep, a shorter one is the beginning.

    Args:
        problems: how many.
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar.

    Raises:
        ParameterError: it is no number of problems.
        StoreError: the table could not be kept; nothing is solved.
        Refusal: numba is not installed, and riccati solves nothing without it.
        Failed: riccati could not be compiled, so that another solver would have been judged.
    """
    problems = PROBLEMS.check("problems", problems)
    need_numba("a sweep is of riccati, which it compiles")
    check_folder()
    began, total = time.perf_counter(), Tally()
    compile_ahead([Experiment()])
    whole, rest = divmod(problems, OF_A_LAYOUT)
    sizes = [OF_A_LAYOUT] * whole + [rest] * (rest > 0)

    label = "layouts" if progress else ""
    for _, tally in parallel(_tally, [*enumerate(sizes)], workers, label):
        total += tally
    table = SweepTable(total, {"seed": SEED, **sealed.about(time.perf_counter() - began)})
    sealed.save(path(), {"about": table.about, "tally": asdict(total)})
    return table


def _tally(layout_and_size: tuple[int, int]) -> Tally:
    return tally_of(*layout_and_size)


def path() -> Path:
    """Where the latest sweep is kept, beside the benchmark."""
    return folder() / "sweep.json"


def read(place: Path) -> SweepTable:
    """A table that `sweep` kept.

    Raises:
        DamagedSweep: it is missing, or something else.
    """
    return sealed.read(
        place,
        lambda kept: SweepTable(Tally(**kept["tally"]), kept["about"]),
        DamagedSweep,
        "nmpcrl bench --sweep",
    )


def tally_of(layout: int, problems: int) -> Tally:
    """The first problems of one drawn layout."""
    rng = np.random.default_rng(np.random.SeedSequence(SEED, spawn_key=(layout,)))
    task = paper.task(rng.uniform(paper.LOWER[:2], paper.UPPER[:2], (OBSTACLES, 2)).tolist())
    ours, ipopt = (paper.controller(task, solver=name) for name in (Riccati.name, "ipopt"))
    total = Tally()
    for k in range(problems):
        state, theta, action = drawn(rng, ours)
        total += judged(ours, ipopt if k % COMPARED == 0 else None, state, theta, action)
    return total


def drawn(rng: np.random.Generator, nmpc: Nmpc) -> tuple[Vector, Vector, Vector | None]:
    """A state, theta, and perhaps an action."""
    low = np.append(paper.LOWER[:2], -np.pi)
    state = rng.uniform(low, np.append(paper.UPPER[:2], np.pi))
    lightest, heaviest = np.log(WEIGHTS)
    weights = np.exp(rng.uniform(lightest, heaviest, len(paper.THETA_INIT) - 1))
    theta = np.append(weights, rng.uniform(*TIGHTENED))
    action = rng.uniform(nmpc.plant.lower, nmpc.plant.upper)
    return state, theta, action if rng.random() < WITH_ACTION else None


def judged(
    ours: Nmpc, ipopt: Nmpc | None, state: Vector, theta: Vector, action: Vector | None
) -> Tally:
    """How one problem went."""
    asked = Tally(tried=1, with_action=int(action is not None))
    try:
        solution = ours.solve(state, theta, action=action)
    except SolverError:
        return asked + Tally(failed=1)
    if solution.solver != ours.solver.name:
        raise RuntimeError(f"{solution.solver} solved instead of {ours.solver.name}")
    kept = solution.violation <= KEPT
    residual = ours.kkt_residual(solution) if kept else 0.0
    found = Tally(
        at_once=int(solution.restarts == 0),
        restarted=int(solution.restarts > 0),
        outside=int(not kept),
        broken=int(not (_is_sound(ours.plant, solution) and np.isfinite(residual))),
        kkt=residual,
    )
    return asked + found + (_against(ipopt, solution, action) if ipopt and kept else Tally())


def _is_sound(plant: Plant, solution: Solution) -> bool:
    """Whether all inputs are within their bounds and all numbers finite."""
    inputs = solution.inputs
    finite = np.isfinite([solution.value, *solution.features, *solution.point]).all()
    return bool(finite and (plant.lower <= inputs).all() and (inputs <= plant.upper).all())


def _against(ipopt: Nmpc, solution: Solution, action: Vector | None) -> Tally:
    """Whether Ipopt, from a standing start as well, finds the same minimum."""
    try:
        other = ipopt.solve(solution.state, solution.theta, action=action).value
    except SolverError:
        return Tally(ipopt_failed=1)
    if abs(solution.value - other) <= SAME * max(1.0, abs(other)):
        return Tally(equal=1)
    return Tally(better=1) if solution.value < other else Tally(worse=1)
