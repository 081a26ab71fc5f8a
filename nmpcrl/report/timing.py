"""What pages say of times of learning steps."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from nmpcrl.bench import learners
from nmpcrl.bench.saving import saving
from nmpcrl.report.cited import Cited


def measured_on(about: Mapping[str, Any]) -> str:
    """The machine and the day of a measurement; `about` as `published` says it."""
    machine = about["machine"]
    return f"{machine['cores']} cores ({machine['processor']}, {about['date']})"


def to_es(timings: pd.DataFrame, solver: str, learner: str) -> Cited:
    """The published time of a step of a learner over one of ES, with its 95 % interval.

    Args:
        timings: of `time_learners`.
        solver: name of both's.
        learner: name.
    """
    return Cited(learners.ratio(timings, solver, learner), of_steps(learner, solver))


def of_steps(learner: str, solver: str) -> str:
    """The quantity of that ratio; see `cited`."""
    return f"step of {learner} in steps of ES, with {solver}: the published measurement"


def ratios_at_paper_speed(timings: pd.DataFrame) -> tuple[float, float]:
    """C3's ratio at the paper's time of a solve: if all solves took alike, and with warm starts."""
    model, solve = saving(timings), 1e3 * learners.PAPER_SOLVE
    return model.ratio(solve, warm=1.0), model.ratio(solve)
