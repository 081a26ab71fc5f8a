"""How the time of a solve grows with the horizon."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.control import SolverError
from nmpcrl.study import paper


def time_horizons(
    states: Sequence[Vector],
    theta: Vector,
    horizons: Sequence[int] = (5, 10, 20, 40, 80),
    *,
    layout: str = "A",
    solvers: Sequence[str] = ("riccati", "fatrop"),
    repetitions: int = 3,
) -> pd.DataFrame:
    """Time of a solve from a standing start, one row a state, horizon and solver.

    The solvers take turns, in this process and with one thread, so that a change of the machine's
    speed meets all alike. Each solve is made twice and the second one counts: the first finds the
    processor's caches full of the other solver.

    Returns:
        Columns state (its number), horizon, solver, ms (the median of the repetitions), iterations,
        us_per_iteration (nan where the solver began more than once), value; nan where it failed.
    """
    controllers = {
        (horizon, solver): paper.nmpc(layout, horizon=horizon, solver=solver)
        for horizon in horizons
        for solver in solvers
    }
    for controller in controllers.values():
        controller.solve(paper.task(layout).start, theta)  # transcribes
    rows = []
    for _ in range(repetitions):
        for state in range(len(states)):
            for (horizon, solver), controller in controllers.items():
                place = {"state": state, "horizon": horizon, "solver": solver}
                try:
                    controller.solve(states[state], theta)
                    solution = controller.solve(states[state], theta)
                except SolverError:
                    rows.append(place)
                    continue
                each = 1e6 * solution.seconds / solution.iterations
                rows.append(
                    place
                    | {
                        "ms": 1e3 * solution.seconds,
                        "iterations": solution.iterations,
                        "us_per_iteration": np.nan if solution.restarts else each,
                        "value": solution.value,
                    }
                )
    return pd.DataFrame(rows).groupby(["state", "horizon", "solver"]).median().reset_index()


def growth(timings: pd.DataFrame, column: str) -> dict[str, float]:
    """For each solver the exponent k of column ~ N^k, by least squares on the medians' logarithms.

    Args:
        timings: of `time_horizons`.
        column: "ms" or another.
    """
    medians = timings.groupby(["solver", "horizon"])[column].median().unstack("solver").dropna()
    across = np.log(medians.index.to_numpy(float))
    return {
        str(solver): float(np.polyfit(across, np.log(medians[solver].to_numpy()), 1)[0])
        for solver in medians
    }
