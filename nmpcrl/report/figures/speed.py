"""Figures of the appendix on the solver: what a solve does, and what it and a step cost."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from nmpcrl import Matrix, Vector
from nmpcrl.bench.learners import PAPER_SOLVE
from nmpcrl.bench.saving import saving as saving_of
from nmpcrl.report.figures.style import (
    AT_ONE,
    BAND,
    INK,
    LIMIT,
    LOOKS,
    TEAL,
    WINE,
    Drawn,
    page,
    subplots,
    titled,
)

STARTS = {"cold": (INK, "o-"), "shifted": (TEAL, "s--"), "same state": (WINE, "D-.")}
MARKERS = {"riccati": "o", "fatrop": "s", "ipopt": "^", "ipopt MX": "v", "rebuilt": "D"}


@page
def row_prices(
    h: Vector, penalties: Mapping[float, Vector], prices: Mapping[float, Vector]
) -> Drawn:
    """What a row adds to the objective, and its multiplier, for some barrier parameters.

    Args:
        h: how far the constraint is violated, shape (k,).
        penalties: mu -> W sigma, shape (k,).
        prices: mu -> lam / W, shape (k,).
    """
    figure, (left, right) = subplots(1, 2, height=3.3)
    shades = ("#BC6F9A", "#A0487A", WINE)
    for (mu, penalty), shade, line in zip(penalties.items(), shades, (":", "--", "-"), strict=True):
        left.plot(h, penalty, color=shade, ls=line)
        right.plot(h, prices[mu], color=shade, ls=line, label=f"μ = {mu:g}")
    weight = penalties[min(penalties)][-1] / h[-1]
    left.plot(h, np.maximum(0, weight * h), color=INK, lw=0.8)
    right.plot(h, np.heaviside(h, 0.5), color=INK, lw=0.8, label="μ → 0")
    left.set_title("the cost of its slack")
    left.set(xlabel="$h$ (no unit)", ylabel=r"$W \sigma$ [cost]")
    right.set_title("its multiplier")
    right.set(xlabel="$h$ (no unit)", ylabel=r"$\lambda / W$ (no unit)")
    title = "The barrier rounds a kink off, and turns a step into a smooth price"
    return titled(figure, title, legend=right)


@page
def sparsity(by_kind: Matrix, folded: Matrix, step: int) -> Drawn:
    """Where the KKT matrix is not zero: sorted by kind, and by stage with its rows folded away.

    Args:
        by_kind: variables, then multipliers, shape (k, k).
        folded: by stage, without slacks and the multipliers of their constraints, shape (l, l).
        step: how many unknowns the recursion eliminates at once.
    """
    figure, panels = subplots(1, 2, height=3.3)
    titles = (f"{len(by_kind)} unknowns by kind", f"{len(folded)} by stage, rows folded away")
    for axes, matrix, title in zip(panels, (by_kind, folded), titles, strict=True):
        axes.spy(matrix, markersize=max(0.3, 190 / len(matrix)), color=INK, marker="s", mew=0)
        axes.set_title(title)
        axes.set(xticks=[], yticks=[], xlabel=f"bandwidth {bandwidth(matrix)} [unknowns]")
        axes.spines[["top", "right"]].set_visible(True)
    corner = len(folded) - step - 0.5
    look: dict[str, Any] = {"fill": False, "ec": WINE, "lw": 1.8, "zorder": 5, "clip_on": False}
    panels[1].add_patch(Rectangle((corner, corner), step, step, **look))
    far = bandwidth(folded)
    return titled(figure, f"Stage by stage, no entry is farther than {far} from the diagonal")


def bandwidth(matrix: Matrix) -> int:
    """The largest distance of a nonzero from the diagonal."""
    row, column = np.nonzero(matrix)
    return int(np.abs(row - column).max(initial=0))


@page
def convergence(
    straight: pd.DataFrame, traces: Mapping[str, pd.DataFrame], tolerance: float
) -> Drawn:
    """The KKT error of a cold solve with two Hessians, and of the solves from three starts.

    Args:
        straight: of `trace` with `curvature=False`, of the cold solve.
        traces: cold, shifted or same state -> `trace`.
        tolerance: where the solver stops.
    """
    figure, (left, right) = subplots(1, 2, height=3.6, sharey=True)
    left.loglog(straight.index + 1, straight.error, color=TEAL, ls="--", label="Gauss-Newton")
    exact = traces["cold"].error
    left.loglog(exact.index + 1, exact, "o-", color=INK, ms=4, label="exact Hessian")
    left.set_title("a cold solve")
    left.set(xlabel="iteration + 1 (no unit)", ylabel="KKT error (no unit)")
    left.legend(fontsize="small", loc="lower left")
    for name, iterates in traces.items():
        color, line = STARTS[name]
        right.semilogy(iterates.error, line, color=color, ms=4, label=name)
    right.xaxis.set_major_locator(MaxNLocator(integer=True))
    right.set_title("three starts")
    right.set(xlabel="iteration (no unit)")
    right.legend(fontsize="small")
    for axes in (left, right):
        axes.axhline(tolerance, **LIMIT)
    counts = ", ".join(f"{name} {len(iterates) - 1}" for name, iterates in traces.items())
    return titled(figure, f"Iterations with the exact Hessian: {counts}")


@page
def saving(timings: pd.DataFrame, others: Mapping[str, float]) -> Drawn:
    """Claim C3: a step of RDES over one of ES, against the time of one solve.

    Args:
        timings: of `time_learners`.
        others: solver that no learner was timed with -> time of a solve [ms].
    """
    figure, axes = subplots(height=3.7)
    model = saving_of(timings)
    theirs, (low, high) = 1e3 * PAPER_SOLVE, model.break_even_within
    times = np.geomspace(0.6 * model.solve[0], 2.5 * theirs, 300)
    axes.plot(times, model.ratio(times), color=LOOKS["RDES"].color)
    axes.axhline(0.5, **LIMIT)
    axes.axhline(1.0, **AT_ONE)
    for row in timings[timings.learner == "RDES"].itertuples():
        axes.plot(row.ms_per_solve, row.ratio, MARKERS[row.solver], color=INK, label=row.solver)
    for solver, solve in others.items():  # whose learners were not timed: on the curve
        axes.plot(solve, model.ratio(solve), MARKERS[solver], color=INK, mfc="white", label=solver)
    axes.plot(theirs, 0.5, "*", color=INK, markersize=11, label="the paper")
    axes.axvspan(low, high, **BAND)
    axes.axvline(model.break_even, **AT_ONE, linestyle="--")
    text = f" break-even: {model.break_even:.1g} ms\n ({low:.1g} to {high:.1g})"
    place: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "va": "top"}
    axes.annotate(text, (high, 0.97), fontsize="small", **place)
    axes.set(xscale="log", xlabel="time of a solve of RDES [ms]", ylim=(0, None))
    axes.set_ylabel("step of RDES / step of ES (no unit)")
    axes.xaxis.set_major_formatter("{x:g}")
    title = f"RDES saves time from a solve of about {model.break_even:.1g} ms on"
    return titled(figure, title, legend=axes)
