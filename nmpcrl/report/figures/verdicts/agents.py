"""What SAC and TD3 cost while they are trained, beside theta_init and the best search."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator, PercentFormatter

from nmpcrl.report.figures.style import LIMIT, SUBTITLE, TEAL, WINE, Look, headed, page, subplots
from nmpcrl.studies.agents import Course

AGENT_LOOKS = {"SAC": Look(WINE, "-", "o"), "TD3": Look(TEAL, (0, (5, 1)), "s")}
SEARCHED: dict[str, Any] = {"color": "0.25", "linewidth": 1.2, "linestyle": "-."}
TICKS = (100, 300)  # episodes, between the first and the last
APART = 2.5  # factor between two ticks, so that their numbers do not touch
DEAREST = 3.0  # in parts of theta_init's cost; what is dearer is not drawn


@page
def courses(panels: Mapping[str, Sequence[Course]], search: Mapping[str, float]) -> Figure:
    """One panel each: the median cost over episodes, with its interval.

    Args:
        panels: by title, the course of each agent; the first says what is found.
        search: by title, what the best search costs there in parts of theta_init's.
    """
    options: dict[str, Any] = {"sharey": True, "squeeze": False}
    figure, grid = subplots(1, len(panels), 3.0, tall=2.6 * len(panels) + 0.4, **options)
    for axes, (title, each) in zip(grid.flat, panels.items(), strict=True):
        axes.set(xlabel="episodes", xscale="log", ylim=(0.8, DEAREST), yscale="log")
        axes.axhline(1, **LIMIT, label=r"$\theta_\mathrm{init}$")
        if title in search:
            axes.axhline(search[title], **SEARCHED, label="best search, 50 episodes")
        for one in each:
            _draw(axes, one)
        axes.set_title(title, **SUBTITLE)
    first = grid.flat[0]
    first.set(ylabel=r"cost over that of $\theta_\mathrm{init}$")
    first.set_yticks([0.8, 1, 1.5, 2, 3])
    first.yaxis.set_major_formatter(PercentFormatter(1, 0))
    first.yaxis.set_minor_formatter(NullFormatter())
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return headed(figure, _finding(next(iter(panels.values()))))


def _draw(axes: Axes, one: Course) -> None:
    look, (low, high) = AGENT_LOOKS[one.agent], one.interval
    axes.fill_between(one.episodes, low, high, facecolor=to_rgba(look.color, 0.15),
                      edgecolor=look.color, linewidth=0.7, linestyle=look.linestyle)  # fmt: skip
    axes.plot(one.episodes, one.median, label=one.agent, marker=look.marker, markersize=4,
              **look.line)  # fmt: skip
    first, last = one.episodes[0], one.episodes[-1]
    between = [tick for tick in TICKS if APART * first <= tick <= last / APART]
    ticks = [first, *between, last]
    axes.set_xticks(ticks, [f"{tick:,}" for tick in ticks])
    axes.xaxis.set_minor_locator(NullLocator())


def _finding(each: Sequence[Course]) -> str:
    """When each agent matches, in a title."""
    alike: dict[str, list[str]] = {}
    for one in each:
        _, always = one.matched
        until = f"from {always:.0f} episodes on" if np.isfinite(always) else (
            f"not by episode {one.episodes[-1]:,}"
        )  # fmt: skip
        alike.setdefault(until, []).append(one.agent)
    said = [f"{' and '.join(names)} {until}" for until, names in alike.items()]
    return rf"From nothing, the median matches $\theta_\mathrm{{init}}$: {', '.join(said)}"
