"""What the appendix on performance says where a measurement decides how it has to be said."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.bench import learners, summary
from nmpcrl.bench.summary import Bench, Saving
from nmpcrl.bench.targets import Target
from nmpcrl.report.cited import Cited

PUBLISHED = "the published measurement"
NOTICED = 0.005  # a share below this is shown as 0 %


def used_by_others(share: float) -> str:
    """How busy the machine was.

    Args:
        share: of the cores that other programs used, the largest before any measurement.
    """
    if share < NOTICED:
        return "Just before each measurement, no other program used the processor."
    return f"Just before a measurement, other programs used up to {share:.0%} of the cores."


def lost_problems(solvers: pd.DataFrame) -> str:
    """How often a solver ends above the best value or without one; `solvers` as in `summary`."""
    lost = (solvers.worse + solvers.failed).groupby("solver").max()
    if lost.max() == 0:
        return "Both are zero for every solver: no solver bought its speed with worse plans."
    riccati = lost[summary.FORMULATIONS[0]]
    others = lost.drop(summary.FORMULATIONS[0])
    return (
        f"Together they are {riccati:.1%} for riccati and at most {others.max():.1%} for the"
        f" others ({others.idxmax()})."
    )


def beside_mpcrl(bench: Bench) -> str:
    """How long a step of mpcrl takes, and one of ES."""
    theirs, ours = summary.against_mpcrl(bench)
    if not np.isfinite(theirs):
        return "It is not installed here, so its step was not measured."
    return (
        f"A step takes {theirs:.1f} ms, {theirs / ours:.0f} times as long as a step of ES here"
        f" ({1e3 * ours:.0f} µs). Nearly all of it is spent in the solver."
    )


def break_even(model: Saving) -> str:
    """From which time of a solve on the network saves time."""
    if model.break_even == 0:
        return "With these times the network saves time, however fast the solver is."
    if np.isinf(model.break_even):
        return "With these times the network saves no time, however slow the solver is."
    low, high = model.break_even_within
    within = "" if np.isnan(low) else f" (it lies between {low:.1g} and {high:.1g} ms)"
    return (
        "The network saves time only where a solve takes more than about"
        f" {model.break_even:.1g} ms{within}."
    )


def slow_solves(model: Saving, solve: float) -> str:
    """What the ratio comes to with solves as slow as that, and what keeps it from one half.

    Args:
        model: of the times of RDES and ES.
        solve: time of a solve of RDES [ms].
    """
    return (
        f"With solves of {solve / 1e3:.2f} s, the paper's, a step of RDES would take"
        f" {model.ratio(solve):.2f} of the time of a step of ES if warm starts helped as they help"
        f" the slowest solver here, and {model.ratio(solve, warm=1.0):.2f} if all solves took alike"
        " (C3)."
    )


def measured_on(about: Mapping[str, Any]) -> str:
    """The machine and the day of a measurement; `about` as `published` and the benchmark say it."""
    machine = about["machine"]
    return f"{machine['cores']} cores ({machine['processor']}, {about['date']})"


def coverage(timings: pd.DataFrame) -> str:
    """How many of the repetitions' own intervals hold what they come to together.

    Args:
        timings: of `time_learners_repeatedly`.
    """
    others = timings[timings.learner != learners.REFERENCE]
    times, least = int(others.repetitions.iloc[0]), int(others.inside.min())
    share = others.inside.sum() / others.repetitions.sum()
    return (
        f"The measurement was repeated {times} times, and the intervals are of how far the"
        f" repetitions are apart. Each repetition has an interval of 95 % of its own: at least"
        f" {least} of {times} contain the ratio of all repetitions together, for every learner and"
        f" solver, and {share:.0%} over all."
    )


def to_es(timings: pd.DataFrame, solver: str, learner: str, source: str = PUBLISHED) -> Cited:
    """The measured time of a step of a learner over one of ES, with its 95 % interval.

    Args:
        timings: of `time_learners`.
        solver: name of both's.
        learner: name.
        source: where the times come from.
    """
    return Cited(learners.ratio(timings, solver, learner), of_steps(learner, solver, source))


def of_steps(learner: str, solver: str, source: str = PUBLISHED) -> str:
    """The quantity of that ratio; see `cited`."""
    return f"step of {learner} in steps of ES, with {solver}: {source}"


def ratios_at_paper_speed(timings: pd.DataFrame) -> tuple[float, float]:
    """C3's ratio at the paper's time of a solve: if all solves took alike, and with warm starts."""
    model, solve = summary.saving(timings), 1e3 * summary.PAPER_SOLVE
    return model.ratio(solve, warm=1.0), model.ratio(solve)


def at_paper_speed(timings: pd.DataFrame) -> str:
    """What C3's ratio would be with solves as slow as the paper's; `timings` of `time_learners`."""
    return slow_solves(summary.saving(timings), 1e3 * summary.PAPER_SOLVE)


def reached(targets: Sequence[Target]) -> str:
    """How many targets are reached, missed and not measured, without what there is none of."""
    outcomes = [one.outcome for one in targets]
    counts = {word: outcomes.count(word) for word in ("reached", "missed", "not measured")}
    (word, first), *others = [(word, count) for word, count in counts.items() if count]
    if not others:
        return f"All {first} targets are {word}."
    parts = [f"{first} are {word}", *(f"{count} {word}" for word, count in others)]
    return f"Of {len(outcomes)} targets, {', '.join(parts[:-1])} and {parts[-1]}."
