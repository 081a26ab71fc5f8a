"""From the measured columns to numbers: pure functions of what `read_or_measure` returns."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

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


@dataclass(frozen=True)
class Saving:
    """The time of a step of RDES over that of ES when a solve takes t milliseconds (claim C3).

    ES: 2 t + rest; RDES: t + network + rest, all but t measured here.
    """

    network: float  # fit and prediction [ms]
    rest: float  # of a step of ES, all but its solves [ms]
    rest_rdes: float  # of a step of RDES, all but solve and network [ms]

    def ratio(self, solve: Any) -> Any:
        """RDES over ES for a solve of so many milliseconds."""
        return (solve + self.network + self.rest_rdes) / (2 * solve + self.rest)

    def solve_at(self, ratio: float) -> float:
        """The time of a solve [ms] at which RDES takes `ratio` of the time of ES; above 1/2."""
        rdes = self.network + self.rest_rdes
        return (rdes - ratio * self.rest) / (2 * ratio - 1)

    @property
    def break_even(self) -> float:
        """The time of a solve [ms] below which the network costs more than it saves."""
        return self.solve_at(1.0)


def saving(bench: Bench) -> Saving:
    """C3's curve, from the learners with the fastest solver."""
    table = learners(bench)
    mine = table[table.solver == FORMULATIONS[0]].set_index("learner")
    return Saving(
        network=float(mine.ms_per_fit["RDES"]),
        rest=float(mine.ms_per_rest["ES"]),
        rest_rdes=float(mine.ms_per_rest["RDES"]),
    )


def measured_ratios(bench: Bench) -> pd.DataFrame:
    """RDES over ES as the learners ran, a row a solver: solve (of RDES and of ES) [ms], ratio."""
    table = learners(bench)
    rows = {}
    for solver in table.solver.unique():
        mine = table[table.solver == solver].set_index("learner").ms_per_solve
        rows[solver] = {
            "solve": mine["RDES"],
            "solve_es": mine["ES"],
            "ratio": ratio(table, solver, "RDES").value,
        }
    return pd.DataFrame.from_dict(rows, orient="index")
