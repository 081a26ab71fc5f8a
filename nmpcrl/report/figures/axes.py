"""What figures are made of: maps, axes over episodes, curves of runs, logarithmic axes, legends."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.container import BarContainer
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

from nmpcrl import Vector
from nmpcrl.control import Task
from nmpcrl.report.figures.style import (
    BAND,
    DECAY_TITLES,
    INK,
    LOOKS,
    WIDTH,
    Drawn,
    hatched,
    subplots,
)
from nmpcrl.study.records import Records
from nmpcrl.study.store import Runs

DEEP = 1e4  # what is less than this part of a threshold is drawn as much
LEAST = 1.5  # high over low of an axis that has hardly anything to show
FEW = 20  # high over low of an axis on which powers of ten are too few
MAPS = 2  # side by side


def draw_task(axes: Axes, task: Task, *, labels: bool = True) -> None:
    """Obstacles, the circle Xi = 0 around each, start and target; equal scales."""
    x, y, clearance = task.discs
    for place in zip(x, y, clearance / 2, strict=True):
        disc = {"fc": "#CFCFCF", "ec": "#8A8A8A", "lw": 0.8}
        axes.add_patch(Circle(place[:2], place[2] - task.robot_diameter / 2, **disc))
        axes.add_patch(Circle(place[:2], place[2], fill=False, ec="#8A8A8A", ls="--", lw=0.8))
    axes.plot(*task.start[:2], "o", color=INK, ms=5)
    axes.plot(*task.target[:2], "*", color=INK, ms=9)
    if labels:
        above: dict[str, Any] = {"xytext": (0, 7), "textcoords": "offset points", "va": "bottom"}
        axes.annotate("start", tuple(task.start[:2]), ha="left", **above)
        axes.annotate("target", tuple(task.target[:2]), ha="center", **above)
        axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal")


def panels(
    names: Sequence[str], row: float, rest: float, columns: int = MAPS, **options: Any
) -> tuple[Drawn, dict[str, Axes], Any]:
    """A panel for each name, row by row.

    Args:
        names: of what is drawn.
        row: height of a row [inches].
        rest: height of what stands above and below the rows [inches].
        columns: at most.
        options: of `subplots`.

    Returns:
        The figure, the panel of each name, and all panels as rows and columns.
    """
    columns = min(columns, len(names))
    rows = -(-len(names) // columns)
    figure, grid = subplots(rows, columns, row * rows + rest, squeeze=False, **options)
    for axes in grid.flat[len(names) :]:
        axes.set_visible(False)
    return figure, dict(zip(names, grid.flat, strict=False)), grid


def maps(names: Sequence[str], row: float, rest: float) -> tuple[Drawn, dict[str, Axes]]:
    """A map for each layout, all to one scale, with its name above; as `panels`."""
    figure, by_layout, grid = panels(names, row, rest, sharex=True, sharey=True)
    for name, axes in by_layout.items():
        axes.set_title(name)
    for axes in grid[-1]:
        axes.set_xlabel("x [m]")
    for axes in grid[:, 0]:
        axes.set_ylabel("y [m]")
    return figure, by_layout


def over_episodes(axes: Axes, decay: str = "", xlabel: str = "episode") -> None:
    """Name the axis below, on which there is no half of an episode; above, the noise's decay."""
    if decay:
        axes.set_title(DECAY_TITLES[decay])
    axes.xaxis.set_major_locator(MaxNLocator(4, integer=True, min_n_ticks=1))
    axes.set_xlabel(xlabel)


def each_episode(axes: Axes, values: Vector, **look: Any) -> None:
    """One value an episode, from episode 1 on; a single one is a point."""
    mark: dict[str, Any] = {"marker": "o", "markersize": 4}
    alone = np.isfinite(values).sum() == 1
    axes.plot(np.arange(1, len(values) + 1), values, **((mark if alone else {}) | look))


def by_decay(
    runs: Runs[Records],
    learners: Iterable[str],
    measure: Callable[[Records], Vector],
    ylabel: str,
    height: float = 3.2,
) -> tuple[Drawn, Any]:
    """One line a run over the episodes, and a panel for each decay of the noise.

    Args:
        runs: of one layout.
        learners: which are drawn.
        measure: one number an episode of a run.
        ylabel: what it is.
        height: of the figure [inches].
    """
    decays = runs.values_of("decay")
    figure, axes = subplots(1, len(decays), height, sharey=True, squeeze=False)
    for panel, decay in zip(axes[0], decays, strict=True):
        for learner in learners:
            for records in runs.select(learner=learner, decay=decay).values():
                each_episode(panel, measure(records), lw=1.2, **LOOKS[learner].line)
        over_episodes(panel, decay)
    axes[0, 0].set_ylabel(ylabel)
    legend(figure, learners)
    return figure, axes[0]


def plain(axis: Axis) -> None:
    """Write the ticks of a logarithmic axis as 0.5, 1, 2 and not as powers of ten."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def logarithmic(axis: Axes, which: str, values: Vector, border: float) -> Callable[[Any], Any]:
    """Make the "x" or "y" axis logarithmic, with a grey strip at its end for what is infinite.

    Args:
        axis: whose axis it is.
        which: "x" or "y".
        values: all that will be drawn.
        border: a threshold that is to be seen as well.

    Returns:
        What puts values where they are drawn: nan counts as infinite.
    """
    finite = [*values[np.isfinite(values) & (values > border / DEEP)], border]
    high = max(finite)
    low = min(*finite, high / LEAST)
    room = (high / low) ** 0.06
    start, middle, stop = high * room ** np.array([1, 2, 3])
    axis.set(**{f"{which}scale": "log", f"{which}lim": (low / room, stop)})
    if which == "x":
        axis.axvspan(start, stop, **BAND)
        axis.text(middle, 0.01, "∞", transform=axis.get_xaxis_transform(), ha="center")
    else:
        axis.axhspan(start, stop, **BAND)
        axis.text(0.01, middle, "∞", transform=axis.get_yaxis_transform(), va="center")
    ticks = {"x": axis.xaxis, "y": axis.yaxis}[which]
    if high / low < FEW:
        plain(ticks)
    ticks.set_minor_formatter(NullFormatter())
    return lambda drawn: np.clip(np.nan_to_num(drawn, nan=np.inf), low, middle)


def logarithmic_if_wide(*row: Axes) -> None:
    """A run that blows up must not flatten the others, in panels that share a vertical axis."""
    drawn = [np.asarray(line.get_ydata(), float) for axes in row for line in axes.get_lines()]
    values = np.concatenate(drawn)
    values = values[np.isfinite(values)]
    if values.size and values.max() > 5 * values.min():
        row[0].set_yscale("log")


def jitter(count: int, width: float) -> Vector:
    """Places beside each other, so that no run hides another."""
    return np.linspace(-width, width, count) if count > 1 else np.zeros(count)


def below(figure: Drawn, handles: Sequence[Any], labels: Sequence[str] | None = None) -> None:
    """A legend below all panels, in as many columns as there is room for."""
    names = [str(handle.get_label()) for handle in handles] if labels is None else [*labels]
    plain_names = (re.sub(r"[${}_^]", "", re.sub(r"\\[a-zA-Z]+", "x", name)) for name in names)
    widest = 4.8 + 0.56 * max(map(len, plain_names))  # in letters of 10 points, with its line
    columns = max(1, int((7.2 * WIDTH + 2) / widest))  # nothing stands after the last
    figure.legend(handles, names, loc="outside lower left", ncols=columns, alignment="left")


def legend(figure: Drawn, learners: Iterable[str], *others: Line2D) -> None:
    """One entry a learner, below all panels."""
    below(figure, [*(Line2D([], [], label=name, **LOOKS[name].line) for name in learners), *others])


def interval(axes: Axes, y: float, estimate: Any, **look: Any) -> None:
    """A point with its interval of 95 %, at a height; `estimate` has value, low and high."""
    axes.hlines(y, estimate.low, estimate.high, color=look["color"], linewidth=1.6)
    point: dict[str, Any] = {"marker": "o", "markersize": 5, "linestyle": ""}
    axes.plot(estimate.value, y, **(point | look))


def stacked(
    axes: Axes, parts: pd.DataFrame, looks: Mapping[str, tuple[str, str]], height: float
) -> dict[str, BarContainer]:
    """A bar a row of `parts`, made of its columns from left to right."""
    bars, left = {}, np.zeros(len(parts))
    for name, look in looks.items():
        bars[name] = axes.barh(parts.index, parts[name], height, left, label=name, **hatched(*look))
        left += parts[name].to_numpy()
    return bars


def middle_half(
    axes: Axes, along: Any, runs: Any, color: str, method: str = "linear", **look: Any
) -> None:
    """The median of some runs, shape (runs, points), and a band from quartile to quartile."""
    low, median, high = np.nanquantile(runs, (0.25, 0.5, 0.75), axis=0, method=method)  # type: ignore[call-overload]
    axes.fill_between(along, low, high, color=color, alpha=0.15, linewidth=0)
    axes.plot(along, median, color=color, **look)
