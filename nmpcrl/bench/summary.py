"""From the measured columns to numbers: pure functions of what `read_or_measure` returns."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from scipy import optimize

from nmpcrl import Vector
from nmpcrl.bench.learners import PAPER_HOURS, ratio
from nmpcrl.bench.solves import LOOPS
from nmpcrl.study import paper

Bench = dict[str, dict[str, Any]]

WORSE = 1e-6  # a value this much above the best, relative to it or to 1, is a worse minimum
FORMULATIONS = ("riccati", "fatrop", "ipopt", "ipopt MX", "rebuilt")  # fastest first
PAPER_SOLVE = PAPER_HOURS["ES"] * 3600 / (2 * paper.EPISODES * paper.STEPS)  # [s]
BESIDE_OBSTACLES = 8  # inequalities of a stage: four bounds of its inputs, four sides of the box


def solvers(bench: Bench) -> pd.DataFrame:
    """Warm solves of the same problems, a row a loop and solver: see the columns.

    median, p95 and max are in microseconds; iterations are the mean; times is the median over that
    of riccati; worse and failed are shares of the problems.
    """
    solves = pd.DataFrame(bench["solves"])
    rows = []
    for loop in LOOPS:
        mine = solves[solves.warm & (solves.loop == loop)]
        fastest = mine.seconds[mine.solver == FORMULATIONS[0]].median()
        for solver in FORMULATIONS:
            one = mine[mine.solver == solver]
            rows.append(
                {
                    "loop": loop,
                    "solver": solver,
                    **_microseconds(one.seconds),
                    "times": one.seconds.median() / fastest,
                    "iterations": one.iterations.mean(),
                    "worse": (one.suboptimality > WORSE).mean(),
                    "failed": one.suboptimality.isna().mean(),
                }
            )
    return pd.DataFrame(rows).set_index(["loop", "solver"])


def own_loop(bench: Bench) -> pd.DataFrame:
    """Warm solves of riccati alone with the plant, a row a loop: median, p95, max [us]."""
    times = pd.DataFrame(bench["loop"])
    rows = {loop: _microseconds(times.seconds[times.loop == loop]) for loop in LOOPS}
    return pd.DataFrame.from_dict(rows, orient="index")


def _microseconds(seconds: pd.Series) -> dict[str, float]:
    return {
        "median": 1e6 * seconds.median(),
        "p95": 1e6 * seconds.quantile(0.95),
        "max": 1e6 * seconds.max(),
    }


def learners(bench: Bench) -> pd.DataFrame:
    """What `time_learners` measured, times in milliseconds."""
    table = pd.DataFrame(bench["learners"])
    numbers = table.columns.difference(["solver", "learner"])
    return table.astype(dict.fromkeys(numbers, float))  # JSON has None for what is not known


def against_mpcrl(bench: Bench) -> tuple[float, float]:
    """A learning step of mpcrl and one of ES, medians [ms]; nan where mpcrl is not installed."""
    steps = pd.DataFrame(bench["mpcrl"], dtype=object).astype({"seconds": float})
    theirs, ours = (steps.seconds[steps.learner == name].median() for name in ("mpcrl", "ES"))
    return 1e3 * float(theirs), 1e3 * float(ours)


def runs(bench: Bench) -> pd.DataFrame:
    """Whole runs, a row a learner: seconds of the paper's episodes, and what follows.

    processor is the share of the time that the processor worked on the run; hours_paper is Table
    II. Shorter runs are extended by the time of an episode after the second. Memory is the largest
    resident size at the end of an episode [MB]; memory_growth is that over the size after a tenth
    of the episodes, less one.
    """
    episodes, rows = pd.DataFrame(bench["episodes"]), {}
    totals = pd.DataFrame(bench["runs"]).set_index("learner")
    for name, (done, seconds, processor) in totals.iterrows():
        one = episodes[episodes.learner == name]
        last, second = one.seconds.iloc[-1], one.seconds.iloc[min(1, len(one) - 1)]
        left = max(0, paper.EPISODES - int(done))
        early = one.memory.iloc[len(one) // 10]
        rows[name] = {
            "seconds": seconds + left * (last - second) / max(1.0, done - 2),
            "processor": processor / seconds,
            "hours_paper": PAPER_HOURS.get(str(name), np.nan),
            "memory": one.memory.max() / 1e6,
            "memory_growth": one.memory.max() / early - 1,
        }
    return pd.DataFrame.from_dict(rows, orient="index")


def scaling(bench: Bench, varied: str) -> pd.DataFrame:
    """How a solve grows with the "horizon" or the "obstacles", a row a size; medians [us].

    solve, iteration (the solve over its iterations), and per_part: the solve over the number of
    stages, or over the number of all stages' inequality constraints.
    """
    table = pd.DataFrame(bench["scaling"])
    mine = table[table.varied == varied]
    mine = mine.assign(iteration=mine.seconds / mine.iterations)
    rows = 1e6 * mine.groupby("size")[["seconds", "iteration"]].median()
    rows = rows.rename(columns={"seconds": "solve"})
    parts = rows.index if varied == "horizon" else paper.HORIZON * (rows.index + BESIDE_OBSTACLES)
    return rows.assign(per_part=rows.solve / parts)


def most_per_part(bench: Bench, varied: str) -> float:
    """The largest factor by which the time per part is longer at a size than at a smaller one."""
    per_part = scaling(bench, varied).per_part.to_numpy()
    return float(max(per_part[i:].max() / per_part[i] for i in range(len(per_part))))


def marginal(bench: Bench, varied: str) -> tuple[float, float]:
    """The least and the most that one more stage or obstacle adds to an iteration [us].

    Between neighbouring sizes; equal where the time is linear, whatever a call costs besides.
    """
    times = scaling(bench, varied).iteration
    slopes = [
        (times[large] - times[small]) / (large - small) for small, large in pairwise(times.index)
    ]
    return float(min(slopes)), float(max(slopes))


def speed_up(bench: Bench) -> tuple[int, float]:
    """The number of workers, and how many times as fast as one they were; 0 and nan if unknown."""
    if not bench["parallel"]["workers"]:
        return 0, np.nan
    table = pd.DataFrame(bench["parallel"]).set_index("workers").seconds
    return int(table.index.max()), float(table.iloc[0] / table[table.index.max()])


def first_call(bench: Bench, *, cached: bool) -> tuple[float, bool]:
    """Median seconds of the first solve, cost and step of a process, and whether each said so.

    nan where that was not measured.
    """
    table = pd.DataFrame(bench["first"])
    mine = table[table.cached == cached]
    return float((mine.solve + mine.step).median()), bool(mine.notice.all())


@dataclass(frozen=True, eq=False)
class Saving:
    """The time of a step of RDES over that of ES when a solve of RDES takes t (claim C3).

    Eq. (9.1): ES takes 2 u t + r_ES and RDES t + f + r_RDES. A solver leaves the caches in one
    state or another, and gains more or less from a warm start, so all but t was measured beside
    several. Between these it is interpolated over log t, and beyond them it stays. The curve goes
    through what was measured.
    """

    solve: Vector  # t, of each solver that was measured beside, ascending [ms]
    warm: Vector  # u: a solve of ES, which starts nearer to its solution, over one of RDES
    network: Vector  # f: fit and prediction [ms]
    rest: Vector  # r_ES: of a step of ES, all but its solves [ms]
    rest_rdes: Vector  # r_RDES: of a step of RDES, all but solve and network [ms]

    def ratio(self, solve: float | Vector, warm: float | None = None) -> Any:
        """RDES over ES for a solve of so many milliseconds.

        Args:
            solve: t, of any shape.
            warm: u, where another than was measured is to be tried.
        """
        u = self._at(solve, self.warm) if warm is None else warm
        extra = self._at(solve, self.network + self.rest_rdes)
        return (solve + extra) / (2 * u * solve + self._at(solve, self.rest))

    def solve_at(self, ratio: float) -> float:
        """The time of a solve [ms] from which on RDES takes at most `ratio` of the time of ES.

        0 where the fastest solver is slow enough, and infinite where none is.
        """
        times = np.geomspace(1e-3 * self.solve[0], 1e6 * self.solve[-1], 9001)
        above = np.flatnonzero(self.ratio(times) > ratio)
        if not len(above):
            return 0.0
        if above[-1] == len(times) - 1:
            return np.inf
        low, high = times[above[-1]], times[above[-1] + 1]
        return float(optimize.brentq(lambda t: self.ratio(t) - ratio, low, high))

    @property
    def break_even(self) -> float:
        """The time of a solve [ms] below which the network costs more than it saves."""
        return self.solve_at(1.0)

    @property
    def break_even_within(self) -> tuple[float, float]:
        """Between which times the break-even lies, whatever way leads from solver to solver.

        Of the two solvers about it, the least and the most of what a step of RDES takes besides its
        solve, and of u. (nan, nan) where there is no break-even between two solvers.
        """
        k = int(np.searchsorted(self.solve, self.break_even))
        if not 0 < k < len(self.solve):
            return np.nan, np.nan
        beside = slice(k - 1, k + 1)
        costs = (self.network + self.rest_rdes - self.rest)[beside]
        saves = 2 * self.warm[beside] - 1
        if saves.min() <= 0:
            return np.nan, np.nan
        low, high = costs.min() / saves.max(), costs.max() / saves.min()
        return float(max(low, self.solve[k - 1])), float(min(high, self.solve[k]))

    def _at(self, solve: float | Vector, measured: Vector) -> Any:
        return np.interp(np.log(solve), np.log(self.solve), measured)


def saving(table: pd.DataFrame) -> Saving:
    """C3's curve, from the times of RDES and ES with each solver; `table` as of `time_learners`."""
    times = table.set_index(["learner", "solver"])
    rdes = times.loc["RDES"].sort_values("ms_per_solve")
    es = times.loc["ES"].loc[rdes.index]
    columns = {
        "solve": rdes.ms_per_solve,
        "warm": es.ms_per_solve / rdes.ms_per_solve,
        "network": rdes.ms_per_fit,
        "rest": es.ms_per_rest,
        "rest_rdes": rdes.ms_per_rest,
    }
    return Saving(**{name: column.to_numpy(float) for name, column in columns.items()})


def measured_ratios(table: pd.DataFrame) -> pd.DataFrame:
    """RDES over ES as they ran, a row a solver: solve (of RDES and of ES) [ms], ratio.

    Args:
        table: as of `time_learners`.
    """
    rows = {}
    for solver in table.solver.unique():
        mine = table[table.solver == solver].set_index("learner").ms_per_solve
        rows[solver] = {
            "solve": mine["RDES"],
            "solve_es": mine["ES"],
            "ratio": ratio(table, solver, "RDES").value,
        }
    return pd.DataFrame.from_dict(rows, orient="index")
