"""Figures of the appendix on performance: functions of what `bench.read_or_measure` returns."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from nmpcrl.bench import summary
from nmpcrl.bench.summary import Bench
from nmpcrl.report.figures.axes import below, over_episodes, stacked
from nmpcrl.report.figures.style import (
    AT_ONE,
    BAND,
    INK,
    LIMIT,
    LOOKS,
    QUIET,
    STEP_PARTS,
    SUBTITLE,
    headed,
    page,
    subplots,
)
from nmpcrl.study import paper

LABELS = {
    "riccati": "riccati",
    "fatrop": "fatrop",
    "ipopt": "Ipopt, SX",
    "ipopt MX": "Ipopt, MX",
    "rebuilt": "rebuilt each time",
}
MARKERS = {"riccati": "o", "fatrop": "s", "ipopt": "^", "ipopt MX": "v", "rebuilt": "D"}


@page
def solve_times(bench: Bench) -> Figure:
    """Time of a warm solve by solver, a panel a loop: median, up to p95, and the longest."""
    table = summary.solvers(bench)
    loops = table.index.unique("loop")
    figure, axes = subplots(1, len(loops), 2.9, sharex=True, sharey=True, squeeze=False)
    for panel, loop in zip(axes[0], loops, strict=True):
        for row, (solver, one) in enumerate(table.loc[loop].iterrows()):
            marker = MARKERS[str(solver)]
            panel.plot([one["median"], one.p95], [row, row], color=INK, linewidth=3.5, alpha=0.6)
            panel.plot(one["max"], row, "|", color=INK, markersize=8)
            panel.plot(one["median"], row, marker, color=INK)
            if one.times > 1:
                place = {"textcoords": "offset points", "ha": "center", "fontsize": "small"}
                panel.annotate(f"{one.times:.0f}×", (one["median"], row), (0, 7), **place)
        panel.set_title(loop, **SUBTITLE)
        panel.set(xscale="log", xlabel="time of a solve [µs]", ylim=(len(LABELS) - 0.4, -0.6))
    axes[0, 0].set_yticks(range(len(LABELS)), LABELS.values())
    medians = table.loc[loops[0]]["median"]
    fastest, slowest = medians.idxmin(), medians.idxmax()
    times = medians[slowest] / medians[fastest]
    found = (
        f"{LABELS[fastest]} is fastest; {LABELS[slowest]}, a solve takes {times:.0f} times as long"
    )
    return headed(figure, found)


@page
def learning_steps(table: pd.DataFrame) -> Figure:
    """What a learning step is made of, a panel a solver, a bar a learner; of `time_learners`."""
    solvers = table.solver.unique()
    figure, axes = subplots(1, len(solvers), 2.6, sharey=True, squeeze=False)
    for panel, solver in zip(axes[0], solvers, strict=True):
        stacked(panel, _parts(table[table.solver == solver]), STEP_PARTS, 0.65)
        panel.set_title(LABELS[solver], **SUBTITLE)
        panel.set_xlabel("ms a step")
    axes[0, 0].invert_yaxis()
    below(figure, *axes[0, 0].get_legend_handles_labels())
    shares = {}
    for solver in (solvers[0], solvers[-1]):
        rdes = _parts(table[table.solver == solver]).loc["RDES"]
        shares[LABELS[solver]] = rdes["network"] / rdes.sum()
    found = " and ".join(f"{share:.0%} with {name}" for name, share in shares.items())
    return headed(figure, f"Of a step of RDES the network takes {found}")


def _parts(table: pd.DataFrame) -> pd.DataFrame:
    """Milliseconds of each part, a row a learner."""
    mine = table.set_index("learner")
    columns = (mine.solves * mine.ms_per_solve, mine.ms_per_fit.fillna(0.0), mine.ms_per_rest)
    return pd.DataFrame(dict(zip(STEP_PARTS, columns, strict=True)))


@page
def whole_runs(bench: Bench) -> Figure:
    """Seconds of a run, memory over its episodes, and the same runs by one worker and by more."""
    figure, (bars, lines, workers) = subplots(1, 3, 2.9, width_ratios=(1.25, 1.1, 0.8))
    runs = summary.runs(bench)
    for name, run in runs.iterrows():
        bars.bar(name, run.seconds, 0.65, color=LOOKS[str(name)].color)
        hours = "–" if np.isnan(run.hours_paper) else f"{run.hours_paper:.0f} h"
        text = f"{run.seconds:.1f} s\n({hours})"
        bars.annotate(text, (name, run.seconds), (0, 3), **_ABOVE)
    bars.set(ylabel=f"{paper.EPISODES} episodes [s]", ylim=(0, 1.35 * runs.seconds.max()))
    bars.set_title("time (the paper's)", **SUBTITLE)
    episodes = pd.DataFrame(bench["episodes"])
    for name in runs.index:
        one = episodes[episodes.learner == name]
        lines.plot(one.episode, one.memory / 1e6, label=name, **LOOKS[name].line)
    lines.set(ylabel="memory [MB]", ylim=(0, 1.4 * runs.memory.max()))
    over_episodes(lines)
    lines.set_title("memory", **SUBTITLE)
    lines.legend(ncols=2, fontsize="small", loc="lower center")
    _draw_workers(workers, bench)
    count, times = summary.speed_up(bench)
    found = f"ES takes {runs.seconds['ES']:.1f} s and RDES {runs.seconds['RDES']:.1f} s"
    more = f"; {count} workers are {times:.2f} times as fast as one" if count > 1 else ""
    return headed(figure, found + more)


_ABOVE: dict[str, Any] = {
    "textcoords": "offset points",
    "ha": "center",
    "va": "bottom",
    "fontsize": "small",
}


def _draw_workers(axes: Axes, bench: Bench) -> None:
    table = pd.DataFrame(bench["parallel"])
    axes.set_title("at once", **SUBTITLE)
    if table.empty:
        axes.annotate("not measured", (0.5, 0.5), xycoords="axes fraction", ha="center")
        axes.set_axis_off()
        return
    ideal = table.seconds[0] * table.workers[0] / table.workers
    names = [str(workers) for workers in table.workers]
    axes.bar(names, table.seconds, 0.6, color=QUIET)
    for name, seconds in zip(names, ideal, strict=True):
        axes.hlines(seconds, int(name == names[-1]) - 0.4, int(name == names[-1]) + 0.4, INK)
    axes.set(xlabel="workers", ylabel=f"{table.runs[0]} runs of ES [s]")


@page
def scaling(bench: Bench) -> Figure:
    """An iteration against the number of stages and of obstacles, with a straight line."""
    figure, axes = subplots(1, 2, 3.0, sharey=True)
    found = []
    kinds = (("horizon", "stages"), ("obstacles", "obstacles"))
    for panel, (varied, parts) in zip(axes, kinds, strict=True):
        times = summary.scaling(bench, varied).iteration
        slope, fixed = np.polyfit(times.index, times, 1, w=1 / times)
        ends = np.array([0, times.index[-1]])
        panel.plot(ends, fixed + slope * ends, color=QUIET, linestyle="--", label="straight line")
        panel.plot(times.index, times, "o", color=INK, label="measured")
        panel.set(xlabel=parts, xlim=(0, None), ylim=(0, None))
        low, high = summary.marginal(bench, varied)
        found.append(f"{low:.2f} to {high:.2f} µs")
    axes[0].set_ylabel("time of an iteration [µs]")
    axes[0].legend(loc="upper left")
    return headed(figure, f"A stage adds {found[0]} to an iteration, an obstacle {found[1]}")


@page
def saving(timings: pd.DataFrame, solves: pd.Series) -> Figure:
    """Claim C3: a step of RDES over one of ES, against the time of one solve.

    Args:
        timings: of `time_learners`.
        solves: time [ms] of a solve with each solver that no learner was timed with, by name.
    """
    model, measured = summary.saving(timings), summary.measured_ratios(timings)
    figure, axes = subplots(height=3.7)
    theirs = 1e3 * summary.PAPER_SOLVE
    times = np.geomspace(0.6 * measured.solve.min(), 2.5 * theirs, 300)
    axes.plot(times, model.ratio(times), color=LOOKS["RDES"].color, label="Eq. (9.1)")
    axes.axhline(0.5, **LIMIT)
    axes.axhline(1.0, **AT_ONE)
    for solver, one in measured.iterrows():
        _mark(axes, str(solver), one.solve, one.ratio, filled=True)
    for solver, solve in solves.items():
        _mark(axes, str(solver), solve, model.ratio(solve), filled=False)
    axes.plot(theirs, 0.5, "*", color=INK, markersize=11, zorder=3)
    axes.annotate("the paper", (theirs, 0.5), (0, -14), ha="center", **SMALL)
    if 0 < model.break_even < np.inf:
        within = model.break_even_within
        axes.axvspan(*within, **BAND)
        axes.axvline(model.break_even, **AT_ONE, linestyle="--")
        text = f" break-even: {model.break_even:.1g} ms\n ({within[0]:.1g} to {within[1]:.1g})"
        place = (np.nanmax([model.break_even, within[1]]), 0.97)
        axes.annotate(text, place, xycoords=("data", "axes fraction"), va="top", fontsize="small")
    axes.set(
        xscale="log", xlabel="time of a solve of RDES [ms]", ylabel="step of RDES / step of ES"
    )
    axes.set(ylim=(0, 1.1 * max(measured.ratio.max(), model.ratio(times[0]))))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    return headed(figure, _found(measured.ratio, model))


PLACES = {  # of a name, from its point
    "riccati": ((6, 4), "left"),
    "fatrop": ((4, 7), "left"),
    "ipopt": ((0, -15), "right"),
    "ipopt MX": ((4, 7), "left"),
    "rebuilt": ((0, -26), "center"),
}
SMALL: dict[str, Any] = {"textcoords": "offset points", "fontsize": "small"}


def _mark(axes: Axes, solver: str, solve: float, ratio: float, *, filled: bool) -> None:
    """A solver's point; hollow where its learners were not run and the curve is followed."""
    face = INK if filled else "white"
    axes.plot(solve, ratio, MARKERS[solver], color=INK, markerfacecolor=face, zorder=3)
    place, side = PLACES[solver]
    name = LABELS[solver].replace(" each ", "\neach ")
    axes.annotate(name, (solve, ratio), place, ha=side, **SMALL)


def _found(ratios: pd.Series, model: summary.Saving) -> str:
    slowest = (
        f"With {LABELS[str(ratios.idxmax())]}, RDES takes {ratios.max():.2f} times as long as ES"
    )
    if ratios.max() > 1:
        return f"{slowest}; the break-even is at about {model.break_even:.1g} ms"
    return f"RDES saves time with every solver: {slowest[0].lower()}{slowest[1:]}"
