"""What the appendix on performance says where a measurement decides how it has to be said."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from nmpcrl.bench import learners, summary
from nmpcrl.bench.summary import Bench, Saving
from nmpcrl.bench.targets import Target

CLOSE = 0.01  # ratios of times that differ by less are called the same
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
    if model.break_even <= 0:
        return "With these times the network saves time, however fast the solver is."
    return f"The network saves time only where a solve takes more than {model.break_even:.2f} ms."


def model_beside_measured(model: Saving, measured: pd.DataFrame, ratio: float) -> str:
    """From which time of a solve on the model is below a ratio, and whether the slowest solver is.

    Args:
        model: of the times of RDES and ES.
        measured: of `summary.measured_ratios`.
        ratio: of RDES to ES, above 1/2.
    """
    solver, slowest = max(measured.iterrows(), key=lambda row: row[1].solve)
    expected = float(model.ratio(slowest.solve))
    apart = slowest.ratio - expected
    side = "higher" if apart > 0 else "lower"
    where = (
        f"With {solver}, whose solves in RDES take {slowest.solve:.2f} ms, the model gives"
        f" {expected:.2f} and the measurement {slowest.ratio:.2f}"
    )
    end = f", which is {side} for the reasons below." if abs(apart) > CLOSE else ", so they agree."
    return (
        f"By the model, the ratio is below {ratio} where a solve takes more than"
        f" {model.solve_at(ratio):.1f} ms. {where}{end}"
    )


def rdes_to_es(bench: Bench, solver: str) -> str:
    """The measured time of a step of RDES over one of ES, with its 95 % interval."""
    ratio = learners.ratio(summary.learners(bench), solver, "RDES")
    known = np.isfinite([ratio.low, ratio.high]).all()
    return str(ratio) if known else f"{ratio.value:.2f} (too few steps for an interval)"


def at_paper_speed(timings: pd.DataFrame) -> str:
    """What C3's ratio would be with solves as slow as the paper's; `timings` of `time_learners`."""
    ratio = summary.saving({"learners": timings.to_dict("list")}).ratio(1e3 * summary.PAPER_SOLVE)
    return (
        f"With solves as slow as the paper's ({summary.PAPER_SOLVE:.2f} s), a step of RDES would"
        f" take {ratio:.2f} of the time of a step of ES (C3)."
    )


def reached(targets: Sequence[Target]) -> str:
    """How many targets are reached, missed and not measured, without what there is none of."""
    outcomes = [one.outcome for one in targets]
    counts = {word: outcomes.count(word) for word in ("reached", "missed", "not measured")}
    (word, first), *others = [(word, count) for word, count in counts.items() if count]
    if not others:
        return f"All {first} targets are {word}."
    parts = [f"{first} are {word}", *(f"{count} {word}" for word, count in others)]
    return f"Of {len(outcomes)} targets, {', '.join(parts[:-1])} and {parts[-1]}."
