"""Figures of the appendix on the solver: what is sparse, how a solve converges, what it costs."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from nmpcrl import Matrix, Vector
from nmpcrl.bench.scaling import exponents
from nmpcrl.report.figures.axes import below
from nmpcrl.report.figures.style import INK, TEAL, WINE, headed, page, subplots

STARTS = {"cold": (INK, "o-"), "shifted": (TEAL, "s--"), "same state": (WINE, "D-.")}
SOLVER_LOOKS = {"riccati": (WINE, "o-"), "fatrop": (TEAL, "s--"), "ipopt": (INK, "^:")}


@page
def row_prices(
    h: Vector, penalties: Mapping[float, Vector], prices: Mapping[float, Vector]
) -> Figure:
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
    left.set(title="A kink, rounded off", xlabel="$h$ (no unit)", ylabel=r"$W \sigma$ [cost]")
    right.set(
        title="Its multiplier is a price in (0, W)",
        xlabel="$h$ (no unit)",
        ylabel=r"$\lambda / W$ (no unit)",
    )
    below(figure, *right.get_legend_handles_labels())
    return figure


@page
def sparsity(by_kind: Matrix, by_stage: Matrix, folded: Matrix, step: int) -> Figure:
    """Where the KKT matrix is not zero: sorted by kind, by stage, and with its rows folded away.

    Args:
        by_kind: variables, then multipliers, shape (k, k).
        by_stage: the same matrix stage by stage.
        folded: the latter without slacks and the multipliers of their constraints, shape (l, l).
        step: how many unknowns the recursion eliminates at once.
    """
    figure, panels = subplots(1, 3, height=3.1, tall=7.6)
    titles = (f"{len(by_kind)} unknowns", "stage by stage", f"{len(folded)}, rows folded away")
    for axes, matrix, title in zip(panels, (by_kind, by_stage, folded), titles, strict=True):
        axes.spy(matrix, markersize=max(0.3, 190 / len(matrix)), color=INK, marker="s", mew=0)
        axes.set_title(title, fontsize="medium", fontweight="normal")
        axes.set(xticks=[], yticks=[], xlabel=f"bandwidth {bandwidth(matrix)} [unknowns]")
        axes.spines[["top", "right"]].set_visible(True)
    corner = len(folded) - step - 0.5
    look: dict[str, Any] = {"fill": False, "ec": WINE, "lw": 1.8, "zorder": 5, "clip_on": False}
    panels[2].add_patch(Rectangle((corner, corner), step, step, **look))
    far = bandwidth(by_stage)
    return headed(figure, f"Stage by stage, no entry is farther than {far} from the diagonal")


def bandwidth(matrix: Matrix) -> int:
    """The largest distance of a nonzero from the diagonal."""
    row, column = np.nonzero(matrix)
    return int(np.abs(row - column).max(initial=0))


@page
def curvature(exact: pd.DataFrame, straight: pd.DataFrame, tolerance: float) -> Figure:
    """Convergence with the exact Hessian, and with that of Gauss and Newton.

    Args:
        exact: of `trace`.
        straight: of `trace` with `curvature=False`.
        tolerance: where the solver stops.
    """
    figure, axes = subplots(height=3.2)
    axes.loglog(straight.index + 1, straight.error, "s--", color=TEAL, ms=3, label="Gauss-Newton")
    axes.loglog(exact.index + 1, exact.error, "o-", color=WINE, ms=4, label="exact Hessian")
    axes.axhline(tolerance, color=INK, ls=":", lw=1)
    steps, others = len(exact) - 1, len(straight) - 1
    arrived = straight.error.iloc[-1] <= tolerance
    end = f"{others}" if arrived else f"more than {others}"
    axes.set(
        title=f"With the curvature {steps} iterations, without it {end}",
        xlabel="iteration + 1 (no unit)",
        ylabel="KKT error (no unit)",
    )
    axes.legend()
    return figure


@page
def convergence(traces: Mapping[str, pd.DataFrame], tolerance: float) -> Figure:
    """KKT error and barrier parameter, and the distance to the final value, of each start.

    Args:
        traces: cold, shifted or same state -> `trace`.
        tolerance: where the solver stops.
    """
    figure, (left, right) = subplots(1, 2, height=3.7, sharex=True)
    for name, iterates in traces.items():
        color, line = STARTS[name]
        left.semilogy(iterates.error, line, color=color, ms=4, label=name)
        left.semilogy(iterates.mu, color=color, ls=":", lw=1)
        final = iterates.value.iloc[-1]
        gap = np.maximum(np.abs(iterates.value / final - 1), 1e-16)[:-1]
        right.semilogy(gap, line, color=color, ms=4)
    left.axhline(tolerance, color=INK, lw=0.6)
    left.xaxis.set_major_locator(MaxNLocator(integer=True))
    left.set(
        xlabel="iteration (no unit)", ylabel="KKT error (no unit)", title="Error, and μ dotted"
    )
    right.set(xlabel="iteration (no unit)", ylabel="relative (no unit)")
    right.set_title("Distance to the final value")
    counts = ", ".join(f"{name} {len(iterates) - 1}" for name, iterates in traces.items())
    below(figure, *left.get_legend_handles_labels())
    return headed(figure, f"Iterations: {counts}")


@page
def horizons(timings: pd.DataFrame) -> Figure:
    """Time of a solve and of an iteration against the horizon, on logarithmic axes.

    Args:
        timings: of `time_horizons`; a dot is a state, a line goes through the medians.
    """
    figure, (left, right) = subplots(1, 2, height=3.7)
    columns = ("ms", "us_per_iteration")
    for axes, column in zip((left, right), columns, strict=True):
        _against_horizon(axes, timings, column)
    left.set(title="A solve", ylabel="time [ms]")
    right.set(title="An iteration", ylabel="time [µs]")
    first = next(name for name in SOLVER_LOOKS if name in set(timings.solver))
    solve, iteration = (exponents(timings, column)[first] for column in columns)
    below(figure, *left.get_legend_handles_labels())
    orders = f"a solve grows like $N^{{{solve:.2f}}}$, an iteration like $N^{{{iteration:.2f}}}$"
    return headed(figure, f"With {first} {orders}")


def _against_horizon(axes: Axes, timings: pd.DataFrame, column: str) -> None:
    for solver, rows in timings.groupby("solver"):
        color, line = SOLVER_LOOKS[str(solver)]
        axes.loglog(rows.horizon, rows[column], ".", color=color, ms=3, alpha=0.4)
        medians = rows.groupby("horizon")[column].median()
        axes.loglog(medians, line, color=color, ms=5, label=str(solver))
    ticks = sorted(timings.horizon.unique())
    axes.set_xticks(ticks, [str(tick) for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.set_xlabel("horizon [steps]")
