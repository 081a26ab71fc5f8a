"""Figures of what a layout decides: gaps, where claims hold, and the trap that theta_c closes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.statistics import Estimate
from nmpcrl.analysis.trap import Stand, stretch
from nmpcrl.claims.thresholds import improves
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome
from nmpcrl.control import Task
from nmpcrl.report.drawn import label
from nmpcrl.report.figures.axes import draw_task, interval, over_episodes, panels, plain, rows
from nmpcrl.report.figures.style import (
    BAND,
    INK,
    LIMIT,
    OCHRE,
    TEAL,
    WINE,
    Drawn,
    page,
    subplots,
    titled,
)
from nmpcrl.studies.difficulty import OPEN, PILOT
from nmpcrl.studies.population import EXPECTED, STANDING
from nmpcrl.study import paper
from nmpcrl.study.layouts import gaps

NARROW = 1.0  # a gap that is drawn leaves less than this [m]
LOOK: Mapping[Outcome, dict[str, Any]] = {  # of an outcome
    REPRODUCED: {"color": TEAL, "marker": "D", "markersize": 5.5},
    PARTLY: {"color": INK, "marker": "o", "markersize": 5.5},
    NOT: {"color": WINE, "marker": "X", "markersize": 5.5},
    UNDECIDABLE: {"color": "0.5", "marker": "s", "markersize": 5.5},
}
NAMED: dict[str, Any] = {  # the share of A to F
    "marker": "|", "color": OCHRE, "markersize": 11, "markeredgewidth": 2, "linestyle": "",
    "label": "A to F",
}  # fmt: skip
LABELS = {
    "closest": "clearance [BARN]",
    "visibility": "visibility [BARN]",
    "dispersion": "dispersion [BARN]",
    "dimension": "width [BARN]",
    "tortuosity": "tortuosity [BARN]",
    "cost": "initial cost",
    "slope": r"the cost's slope in $\theta_c$",
    "overshoot": r"initial $\alpha\Vert\phi\Vert^2$",
    "closes": r"$\theta_c$ that closes a gap",
}
ROW = 0.23  # height of a row [inches]
SHOWN = 0.03  # theta_c below which a mark stands at the edge
ENDS = ((True, TEAL, "o", 3, "ES improves"), (False, WINE, "X", 4, "it does not"))
MOMENTS = (("#0072B2", "-"), (OCHRE, "--"), (WINE, "-."))  # of a trajectory and its clearances
BEST: dict[str, Any] = {"color": TEAL, "linestyle": "-"}
FIRST: dict[str, Any] = {"color": WINE, "linestyle": "--"}
LINES: dict[str, tuple[str, dict[str, dict[str, Any]]]] = {  # label, and fields of a `Stand`
    "value": ("where it ends", {
        "forever": FIRST | {"label": r"$\ell / (1 - \gamma)$"}, "value": BEST | {"label": "V"},
    }),
    "delta": ("|δ|", {"delta": {"color": INK}}),
    "theta_c": (r"$\theta_c$", {"theta_c": {"color": INK}}),
    "cost": ("cost without noise", {"cost": {"color": INK}}),
}  # fmt: skip


@page
def layouts(rollouts: Mapping[str, Matrix]) -> Drawn:
    """The layouts, theta_init's first rollout in each, and the gaps that it goes through.

    Args:
        rollouts: states of the rollout without noise, shape (K + 1, n), by layout.
    """
    figure, by_name = panels(list(rollouts), 2.0, 0.4)
    margin, closing = paper.task().margin, 0
    for name, states in rollouts.items():
        axes, task = by_name[name], paper.task(name)
        widths = gaps(task, states[:, :2], margin)
        narrowest = min(widths.values(), default=np.inf)
        closing += narrowest <= 0
        draw_task(axes, task, labels=False)
        axes.plot(*states[:, :2].T, color="black", linewidth=1.1)
        for sides, width in widths.items():
            if width < NARROW:
                _gap(axes, task, sides, shut=width <= 0)
        kind = "closing" if narrowest <= 0 else "open"
        axes.set(title=f"{name}: {kind}, {narrowest:+.2f} m", ylim=(-3.0, 6.0))
    title = f"In {closing} of {len(rollouts)} layouts, a gap of the first rollout is closed"
    return titled(figure, rf"{title} at $\theta_c$ = {margin:g}")


def _gap(axes: Axes, task: Task, sides: tuple[int, int], *, shut: bool) -> None:
    """The line between the two sides of a gap, numbered as `gaps` does."""
    centres = np.transpose(task.discs[:2])
    one, other = centres[sides[0]], centres[sides[0]].copy()
    if sides[1] >= 0:
        other = centres[sides[1]]
    else:  # a wall: left, bottom, right, top are -1 to -4
        axis = (-sides[1] - 1) % 2
        other[axis] = (task.lower if sides[1] >= -2 else task.upper)[axis]
    color, line = (WINE, (0, (1, 0.6))) if shut else (TEAL, "-")
    axes.plot(*np.transpose([one, other]), color=color, linestyle=line, linewidth=2.2)


@page
def shares(found: pd.DataFrame, six: pd.DataFrame, finding: str) -> Drawn:
    """One row a claim: in which share of the layouts it holds, beside A to F and what was expected.

    Args:
        found: of `population.shares`, of the drawn layouts.
        six: the same of A to F.
        finding: the title.
    """
    figure, axes = subplots(height=ROW * len(found) + 1.6)
    for y, row in enumerate(found.itertuples()):
        expected = EXPECTED[str(row.claim)]
        width = expected.high - expected.low
        axes.add_patch(Rectangle((expected.low, y - 0.32), width, 0.64, **BAND))
        interval(axes, y, Estimate(row.share, row.low, row.high), **LOOK[row.outcome])
        named = six.share[six.claim == row.claim]
        axes.plot(named, [y] * len(named), **NAMED)
    rows(axes, [label(str(name)) for name in found.claim])
    axes.set(xlim=(-0.02, 1.02), xlabel="share of layouts")
    axes.xaxis.set_major_formatter("{x:.0%}")
    outcomes = [one for one in LOOK if (found.outcome == one).any()]
    handles: list[Any] = [Line2D([], [], label=str(one), **LOOK[one]) for one in outcomes]
    handles += [Line2D([], [], **NAMED), Rectangle((0, 0), 1, 1, label="expected", **BAND)]
    return titled(figure, finding, legend=handles)


@page
def predictors(scores: pd.DataFrame, runs: pd.DataFrame, closes: pd.Series, finding: str) -> Drawn:
    """Where ES ends against where a gap closes, and how well each measure tells that beforehand.

    Args:
        scores: of `difficulty.predictor_scores`.
        runs: of ES, of `rows.table`.
        closes: theta_c at which the first gap of the first trajectory closes, a run's layout each.
        finding: the title.
    """
    figure, (ends, areas) = subplots(2, 1, ROW * len(scores) + 3.9)
    better = improves(runs)
    for well, color, mark, size, name in ENDS:
        there = better == well
        values = runs.theta_8[there].clip(lower=SHOWN)
        ends.plot(closes[there], values, mark, color=color, markersize=size, label=name)
    shut = np.geomspace(SHOWN, OPEN, 50)
    ends.plot(shut, shut, **LIMIT, label="the gap is closed above")
    ends.set(yscale="log", ylabel=r"$\theta_c$ after learning", xlim=(0, None))
    ends.set_xlabel(r"$\theta_c$ at which the first gap closes")
    plain(ends.yaxis)
    order = [*scores.auc.map(lambda one: one.value).sort_values(ascending=False).index]
    areas.axvline(0.5, **LIMIT)
    looks = {PILOT: {"color": TEAL, "marker": "D"}}
    for y, name in enumerate(order):
        interval(areas, y, scores.auc[name], **looks.get(name, {"color": INK}))
    rows(areas, [LABELS[name] for name in order])
    areas.set_xlabel("area under the ROC curve")
    areas.set_title("how well it tells beforehand")
    return titled(figure, finding, legend=ends)


@page
def cliffs(
    grid: Vector,
    costs: Mapping[str, tuple[Vector, Vector]],
    best: Mapping[str, float],
    finding: str,
) -> Drawn:
    """Cost over theta_c with all else best, and with all else as it was, a panel a layout.

    Args:
        grid: of theta_c.
        costs: on the grid, by layout: with the best theta, and with theta_init.
        best: theta_c of the best theta, by layout.
        finding: the title.
    """
    labels = r"$\theta_c$ (no unit)", "cost [thousands]"
    figure, by_layout = panels(list(costs), 1.9, 0.6, labels=labels, sharey=False)
    for layout, panel in by_layout.items():
        along_best, along_init = costs[layout]
        panel.plot(grid, along_init / 1000, label=r"all else as $\theta_\mathrm{init}$", **FIRST)
        panel.plot(grid, along_best / 1000, label="all else best", **BEST)
        panel.axvline(best[layout], **LIMIT)
        panel.set(title=f"layout {layout}", ylim=(0, None))
    return titled(figure, finding, legend=panel)


@page
def trap(task: Task, stands: Sequence[Stand], moments: Sequence[int], finding: str) -> Drawn:
    """One run: where the robot goes at three moments, and what value, TD error and cost do.

    Args:
        task: what the robot moves in.
        stands: of `analysis.trap.stands`.
        moments: which three of them the map shows, the last two of a robot that stands.
        finding: the title.
    """
    figure = Drawn(6.2)
    by_name = figure.subplot_mosaic(
        [["map", "map"], ["value", "delta"], ["theta_c", "cost"]], height_ratios=(2.2, 1, 1)
    )
    _map(by_name["map"], task, [stands[k] for k in moments])
    there = stretch(stands, STANDING)
    along = [one.episode for one in stands]
    away = np.array([not one.arrived for one in stands])
    for name, (ylabel, fields) in LINES.items():
        axes = by_name[name]
        if there:
            axes.axvspan(there[0].episode, there[-1].episode, **BAND)
        for field, look in fields.items():
            values = np.array([getattr(one, field) for one in stands])
            axes.plot(along, np.where(away | (name != "value"), values, np.nan), **look)
        over_episodes(axes)
        axes.set(xlim=(0, along[-1]), ylabel=ylabel)
        axes.set_ylim(bottom=0)
    by_name["value"].set_ylim(top=1.5 * by_name["value"].get_ylim()[1])
    by_name["value"].legend(ncols=2, fontsize="small", loc="upper right")
    by_name["value"].set_title("grey: the robot is stuck")
    return titled(figure, finding)


def _map(axes: Axes, task: Task, shown: Sequence[Stand]) -> None:
    """The way of the robot at each moment, and what plans keep away from."""
    draw_task(axes, task)
    for one, (color, style) in zip(shown, MOMENTS, strict=True):
        for x, y, clearance in np.transpose(task.discs):
            radius = clearance / 2 * np.sqrt(1 + one.theta_c)
            axes.add_patch(Circle((x, y), radius, fill=False, ec=color, ls=style, lw=0.9))
        name = rf"episode {one.episode}, $\theta_c$ = {one.theta_c:.2f}"
        axes.plot(*one.states[:, :2].T, color=color, linestyle=style, linewidth=2, label=name)
        if not one.arrived:
            axes.plot(*one.states[-1, :2], "X", color=color, markersize=8, mec="white")
    axes.legend(loc="lower left", fontsize="small")
