"""What figures are made of: maps, axes over episodes, curves of runs, logarithmic axes, legends."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import to_rgb
from matplotlib.container import BarContainer
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, NullLocator

from nmpcrl import Vector
from nmpcrl.control import Task
from nmpcrl.report.figures.style import BAND, DECAY_TITLES, INK, LOOKS, Drawn, subplots
from nmpcrl.study.store import Runs

DEEP = 1e4  # what is less than this part of a threshold is drawn as much
LEAST = 1.5  # high over low of an axis that has hardly anything to show
FEW = 20  # high over low of an axis on which powers of ten are too few


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
    names: Sequence[str],
    row: float,
    rest: float,
    labels: tuple[str, str] = ("x [m]", "y [m]"),
    **share: bool,
) -> tuple[Drawn, dict[str, Axes]]:
    """A panel for each name, row by row, with its name above; maps, all to one scale.

    Args:
        names: of what is drawn.
        row: height of a row [inches].
        rest: height of what stands above and below the rows [inches].
        labels: of the axes below and on the left.
        share: `sharex` or `sharey`, if panels have scales of their own.

    Returns:
        The figure, and the panel of each name.
    """
    columns = min(2, len(names))
    high = -(-len(names) // columns)
    options: dict[str, Any] = {"sharex": True, "sharey": True, "squeeze": False} | share
    figure, grid = subplots(high, columns, row * high + rest, **options)
    for name, axes in zip_longest(names, grid.flat):
        axes.set(title=name, visible=name is not None)
    for axes in grid[-1]:
        axes.set_xlabel(labels[0])
    for axes in grid[:, 0]:
        axes.set_ylabel(labels[1])
    return figure, dict(zip(names, grid.flat, strict=False))


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
    runs: Runs[Any],
    learners: Iterable[str],
    measure: Callable[[Any], Vector],
    ylabel: str,
) -> tuple[Drawn, Any]:
    """One line a run over the episodes, and a panel for each decay of the noise.

    Args:
        runs: of one layout.
        learners: which are drawn.
        measure: one number an episode of a run.
        ylabel: what it is.
    """
    decays = runs.values_of("decay")
    figure, axes = subplots(1, len(decays), sharey=True, squeeze=False)
    for panel, decay in zip(axes[0], decays, strict=True):
        for learner in learners:
            for run in runs.select(learner=learner, decay=decay).values():
                each_episode(panel, measure(run), lw=1.2, **LOOKS[learner].line)
        over_episodes(panel, decay)
    axes[0, 0].set_ylabel(ylabel)
    return figure, axes[0]


def plain(axis: Axis) -> None:
    """Write the ticks of a logarithmic axis as 0.5, 1, 2 and not as powers of ten."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def logarithmic(axes: Axes, values: Vector, border: float) -> Callable[[Any], Any]:
    """Make the vertical axis logarithmic, with a grey strip at its end for what is infinite.

    Args:
        axes: whose axis it is.
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
    axes.set(yscale="log", ylim=(low / room, stop))
    axes.axhspan(start, stop, **BAND)
    axes.text(0.01, middle, "∞", transform=axes.get_yaxis_transform(), va="center")
    if high / low < FEW:
        plain(axes.yaxis)
    axes.yaxis.set_minor_formatter(NullFormatter())
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


def entries(learners: Iterable[str]) -> list[Line2D]:
    """One entry of a legend a learner."""
    return [Line2D([], [], label=name, **LOOKS[name].line) for name in learners]


def rows(axes: Axes, names: Sequence[str]) -> None:
    """Name rows at 0, 1, 2, the first on top."""
    axes.set_yticks(range(len(names)), names, fontsize="small")
    axes.set_ylim(len(names) - 0.4, -0.6)


def strips(axes: Axes, values: pd.DataFrame, placed: Callable[[pd.Series], Any]) -> list[Line2D]:
    """Every run's number above its layout: learners side by side, the second decay hollow.

    A short line is the median of a learner and decay.

    Args:
        axes: of one panel.
        values: a column a learner; its index has layout and decay.
        placed: where numbers are drawn.

    Returns:
        The entries of a legend.
    """
    layouts, decays = values.index.unique("layout"), values.index.unique("decay")
    columns = [(name, decay) for name in values for decay in decays]
    apart = min(0.19, 0.85 / len(columns))
    for column, (name, decay) in enumerate(columns):
        look = LOOKS.get(name, LOOKS["GES"])
        face = look.color if decay == decays[0] else "white"
        for i, layout in enumerate(layouts):
            known = placed(values[name].xs((layout, decay), level=("layout", "decay")).dropna())
            x = i + apart * (column - (len(columns) - 1) / 2)
            dots = look.dots(mfc=face, markersize=3, mew=0.7)
            axes.plot(x + jitter(known.size, 0.37 * apart), known, **dots)
            if known.size:  # of a half that is infinite and one that is not, the middle is neither
                middle = np.quantile(known, 0.5, method="higher")
                axes.hlines(middle, x - 0.47 * apart, x + 0.47 * apart, color=INK)
    axes.set_xlabel("layout")
    axes.set_xticks(range(len(layouts)), layouts)
    kinds = [Line2D([], [], label=n, **LOOKS.get(n, LOOKS["GES"]).dots()) for n in values]
    for decay, face in zip(decays, (LOOKS["frozen"].color, "white"), strict=False):
        dots = LOOKS["frozen"].dots(marker="o", mfc=face)
        kinds.append(Line2D([], [], label=f"noise per {decay}", **dots))
    return kinds


def interval(axes: Axes, y: float, estimate: Any, **look: Any) -> None:
    """A point with its interval of 95 %, at a height; `estimate` has value, low and high."""
    axes.hlines(y, estimate.low, estimate.high, color=look["color"], linewidth=1.6)
    point: dict[str, Any] = {"marker": "o", "markersize": 5, "linestyle": ""}
    axes.plot(estimate.value, y, **(point | look))


def stacked(
    axes: Axes, parts: pd.DataFrame, looks: Mapping[str, tuple[str, str]], height: float
) -> dict[str, BarContainer]:
    """A bar a row of `parts`, made of its columns, with colour and hatching, from left to right."""
    bars, left = {}, np.zeros(len(parts))
    for name, (color, hatch) in looks.items():
        edge = "0.5" if min(to_rgb(color)) > 0.8 else "white"  # a pale part has an outline
        look: dict[str, Any] = {"facecolor": color, "hatch": hatch, "edgecolor": edge, "lw": 0.5}
        bars[name] = axes.barh(parts.index, parts[name], height, left, label=name, **look)
        left += parts[name].to_numpy()
    return bars


def middle_half(
    axes: Axes, along: Any, runs: Any, color: str, method: str = "linear", **look: Any
) -> None:
    """The median of some runs, shape (runs, points), and a band from quartile to quartile."""
    low, median, high = np.nanquantile(runs, (0.25, 0.5, 0.75), axis=0, method=method)  # type: ignore[call-overload]
    axes.fill_between(along, low, high, color=color, alpha=0.15, linewidth=0)
    axes.plot(along, median, color=color, **look)
