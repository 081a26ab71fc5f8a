"""When a network saves time: a step of RDES over one of ES, by the time of a solve."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy import optimize

from nmpcrl import Vector


@dataclass(frozen=True, eq=False)
class Saving:
    """The time of a step of RDES over that of ES when a solve of RDES takes t (claim C3).

    ES takes 2 u t + r_ES and RDES t + f + r_RDES. A solver leaves the caches in one state or
    another, and gains more or less from a warm start, so all but t was measured beside several.
    Between these it is interpolated over log t, and beyond them it stays. The curve goes through
    what was measured.
    """

    solve: Vector  # t, of each solver that was measured beside, ascending [ms]
    warm: Vector  # u: a solve of ES, which starts nearer to its solution, over one of RDES
    network: Vector  # f: fit and prediction [ms]
    rest: Vector  # r_ES: of a step of ES, all but its solves [ms]
    rest_rdes: Vector  # r_RDES: of a step of RDES, all but solve and network [ms]

    def ratio(self, solve: float | Vector, warm: float | None = None) -> Any:
        """RDES over ES for a solve of t milliseconds, with another u than measured if `warm`."""
        u = self._at(solve, self.warm) if warm is None else warm
        extra = self._at(solve, self.network + self.rest_rdes)
        return (solve + extra) / (2 * u * solve + self._at(solve, self.rest))

    @property
    def break_even(self) -> float:
        """The time of a solve [ms] below which the network costs more than it saves.

        0 where the fastest solver is slow enough, and infinite where none is.
        """
        times = np.geomspace(1e-3 * self.solve[0], 1e6 * self.solve[-1], 9001)
        above = np.flatnonzero(self.ratio(times) > 1.0)
        if not len(above):
            return 0.0
        if above[-1] == len(times) - 1:
            return np.inf
        low, high = times[above[-1]], times[above[-1] + 1]
        return float(optimize.brentq(lambda t: self.ratio(t) - 1.0, low, high))

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


def saving(timings: pd.DataFrame) -> Saving:
    """C3's curve, from the times of RDES and ES with each solver; `timings` of `time_learners`."""
    times = timings.set_index(["learner", "solver"])
    rdes = times.loc["RDES"].sort_values("ms_per_solve")
    es = times.loc["ES"].loc[rdes.index]
    warm, rests = es.ms_per_solve / rdes.ms_per_solve, (es.ms_per_rest, rdes.ms_per_rest)
    columns = rdes.ms_per_solve, warm, rdes.ms_per_fit, *rests
    return Saving(*(column.to_numpy(float) for column in columns))
