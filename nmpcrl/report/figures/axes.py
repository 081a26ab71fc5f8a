"""Parts of figures that know no runs: a map, a logarithmic axis, a legend, a bar in parts."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

from nmpcrl import Vector
from nmpcrl.control import Task
from nmpcrl.report.figures.sheet import fitting
from nmpcrl.report.figures.style import (
    BAND,
    DECAY_TITLES,
    INK,
    LOOKS,
    hatched,
    line,
    subplots,
    thin,
)

DEEP = 1e4  # what is less than this part of a threshold is drawn as much
LEAST = 1.5  # high over low of an axis that has hardly anything to show
FEW = 20  # high over low of an axis on which powers of ten are too few
WHOLE = {"steps": [1, 2, 2.5, 5, 10], "integer": True, "min_n_ticks": 1}  # of a MaxNLocator
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
    axes.set_aspect("equal")


def map_grid(
    names: Sequence[str], row: float, rest: float, **options: Any
) -> tuple[Figure, dict[str, Axes], Any]:
    """A map for each name, to one scale; what is left over in the last row is hidden.

    Args:
        names: of the layouts.
        row: height of a row of maps [inches].
        rest: height of what stands above and below them [inches].
        options: of `subplots`.

    Returns:
        The figure, the map of each name, and all maps row by row.
    """
    columns = min(MAPS, len(names))
    rows = -(-len(names) // columns)
    options = {"squeeze": False, "sharex": True, "sharey": True} | options
    figure, grid = subplots(rows, columns, row * rows + rest, **options)
    for axes in grid.flat[len(names) :]:
        axes.set_visible(False)
    return figure, dict(zip(names, grid.flat, strict=False)), grid


def label_panel(axes: Axes, decay: str = "", xlabel: str = "episode") -> None:
    """Which decay of the noise a panel shows, and whole episodes below."""
    axes.set_title(DECAY_TITLES.get(decay, ""), fontsize="medium", fontweight="normal")
    axes.xaxis.set_major_locator(MaxNLocator(4, integer=True, min_n_ticks=1))
    axes.set_xlabel(xlabel)


def over_episodes(axes: Axes, xlabel: str = "episode") -> None:
    """Name the axis below, on which there is no half of an episode."""
    axes.xaxis.set_major_locator(MaxNLocator("auto", **WHOLE))
    axes.set_xlabel(xlabel)


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


def jitter(count: int, width: float) -> Vector:
    """Places beside each other, so that no run hides another."""
    return np.linspace(-width, width, count) if count > 1 else np.zeros(count)


def below(
    figure: Figure, handles: Sequence[Any], labels: Sequence[str] | None = None, **look: Any
) -> None:
    """A legend below all panels, in as many columns as there is room for."""
    names = [str(handle.get_label()) for handle in handles] if labels is None else [*labels]
    shown: dict[str, Any] = {"ncols": fitting(names), "alignment": "left", **look}
    figure.legend(handles, names, loc="outside lower left", **shown)


def legend(figure: Figure, learners: Iterable[str], *others: Line2D) -> None:
    """One entry a learner, below all panels."""
    below(figure, [*(Line2D([], [], label=name, **line(name)) for name in learners), *others])


def one_entry_each(
    axes: Axes,
    learners: tuple[str, ...],
    names: Mapping[str, str] = MappingProxyType({}),
    *,
    marker: bool = False,
) -> None:
    """A legend with one entry a learner, however many lines it has."""
    for learner in learners:
        look = {**thin(learner), "marker": LOOKS[learner].marker if marker else None}
        axes.plot([], [], label=names.get(learner, learner), **look)
    axes.legend()


def stacked(
    axes: Axes, parts: pd.DataFrame, looks: Mapping[str, tuple[str, str]], height: float
) -> dict[str, BarContainer]:
    """A bar a row of `parts`, made of its columns from left to right."""
    bars, left = {}, np.zeros(len(parts))
    for name, look in looks.items():
        bars[name] = axes.barh(parts.index, parts[name], height, left, label=name, **hatched(*look))
        left += parts[name].to_numpy()
    return bars


def logarithmic_if_wide(row: list[Axes]) -> None:
    """A run that blows up must not flatten the others."""
    points = [line.get_ydata() for axes in row for line in axes.get_lines()]
    values = np.concatenate([np.asarray(y, float) for y in points])
    values = values[np.isfinite(values)]
    if values.size and values.max() > 5 * values.min():
        row[0].set_yscale("log")
