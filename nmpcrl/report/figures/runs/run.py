"""One run on one page: what `nmpcrl show` draws."""

from typing import IO, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from nmpcrl import Vector
from nmpcrl.analysis import metrics
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.axes import draw_task, logarithmic_if_wide
from nmpcrl.report.figures.style import (
    DECAY_TITLES,
    INK,
    LIMIT,
    LOOKS,
    QUIET,
    SUBTITLE,
    headed,
    marked,
    mosaic,
    most_moved,
    page,
    shades,
    symbol,
)
from nmpcrl.report.run import finding, thetas
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.records import Column, Records

HEIGHT = 8.8  # inches
EXTENT = (-2.6, 5.4)  # of the map [m], where nothing stands beyond
BELOW = 2.4  # more of the map [m], for its legend
ABOVE = 1.1  # of the heights of theta, for their legend
PANELS = (("map", "map"), ("theta", "step"), ("noisy", "noise-free"))
ROWS = (1.25, 1, 1)  # relative heights
NAMED = 4  # components of theta that are named, those that move most; the others are grey
WIDE = 10  # what an axis goes up to that is linear
MOVES = 1e-3  # as a share of the largest movement; what moves less is grey
FIRST: dict[str, Any] = {"color": INK, "linestyle": ":", "linewidth": 1.2}


@page
def run_page(records: Records, frozen: Records | None = None) -> Figure:
    """The trajectory without noise, theta, both costs and the size of the steps of one run.

    Args:
        records: the run.
        frozen: the baseline without learning, drawn beside its costs.
    """
    figure, panels = mosaic(PANELS, ROWS, HEIGHT)
    _map(panels["map"], records)
    _theta(panels["theta"], records)
    _steps(panels["step"], records)
    _costs(panels["noisy"], panels["noise-free"], records, frozen)
    return marked(headed(figure, finding(records)), _source(records, frozen))


def write(figure: Figure, file: IO[bytes], kind: str) -> None:
    """Write a page as "svg" or "png"; the same page gives the same bytes."""
    with plt.rc_context({"svg.hashsalt": "nmpcrl"}):
        figure.savefig(file, format=kind, metadata={"Date": None} if kind == "svg" else None)


def _map(axes: Axes, records: Records) -> None:
    """Where theta_init and the last theta lead the robot, without noise."""
    task, episode = Experiment(**records.experiment).task, records.evaluations["episode"]
    draw_task(axes, task)
    look = LOOKS[records.experiment["learner"]]
    for row, style in ((0, FIRST), (-1, {**look.line, "linewidth": 1.8})):
        path = _known(records.evaluations["states"][row])
        label = "θ at the start" if row == 0 else f"θ after {_episodes(episode[row])}"
        if row == 0 or len(episode) > 1:
            axes.plot(path[:, 0], path[:, 1], label=label, **style)
            axes.plot(*path[-1:, :2].T, look.marker, color=style["color"], markersize=4)
    y = [task.start[1], task.target[1], *task.discs[1]]
    low, high = min(EXTENT[0], min(y) - 0.6), max(EXTENT[1], max(y) + 0.6)
    low -= BELOW
    axes.set(xlim=(task.lower[0] - 0.5, task.upper[0]), ylim=(low, high))
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.legend(loc="lower left")
    axes.set_title(f"Without noise, {_ending(records)}", **SUBTITLE)


def _ending(records: Records) -> str:
    """How the last rollout without noise ends."""
    task = Experiment(**records.experiment).task
    states, _ = metrics.final_rollout(records)
    path = _known(states)
    if len(path) < len(states):
        return f"a solve fails after {len(path)} of {len(states)} steps"
    inside = int((task.overlap(path).max(axis=-1) > metrics.TOUCH).sum())
    away = task.distance(path[-1])
    end = "at the target" if away <= ARRIVED else f"{away:.1f} from the target"
    return f"it ends {end}, with {inside or 'no'} state{'s' * (inside > 1)} in an obstacle"


def _theta(axes: Axes, records: Records) -> None:
    """theta after each episode; the components that move most are named."""
    values = thetas(records)
    change = np.nan_to_num(np.ptp(values, axis=0))
    order = np.argsort(-change, kind="stable")
    named = [i for i in order[:NAMED] if change[i] > MOVES * change.max()]
    axes.plot(values[:, [i for i in order if i not in named]], color=QUIET, lw=0.7)
    for i, shade, line in zip(named, shades(len(named)), ("-", "--", "-.", ":"), strict=False):
        name = symbol(paper.THETA_NAMES[i])
        axes.plot(values[:, i], color=shade, linestyle=line, label=name)
    axes.set_title(most_moved(change) if named else "θ does not move", **SUBTITLE)
    axes.set_ylabel("component of θ [-]")
    _by_episode(axes, records)
    if change.max() > WIDE:
        decades = np.log10(np.nanmax(np.abs(values)))
        axes.set_yscale("symlog", linthresh=1, linscale=max(3, decades / 2))
        axes.yaxis.get_major_locator().set_params(numticks=7)  # type: ignore[call-arg]
    if named:
        axes.margins(y=ABOVE)
        axes.legend(loc="upper center", ncols=2, handlelength=1.5, columnspacing=1)


def _steps(axes: Axes, records: Records) -> None:
    """The largest alpha ||phi||^2 of each episode, and the line at 2."""
    largest = metrics.by_episode(records, records.steps["alpha_phi2"], np.max)
    over, count = (records.steps["alpha_phi2"] > OVERSHOOT).sum(), len(records.steps["episode"])
    mark = "o" if np.isfinite(largest).sum() == 1 else None
    axes.plot(_episode(largest), largest, marker=mark, **LOOKS[records.experiment["learner"]].line)
    axes.axhline(OVERSHOOT, **LIMIT)
    worst = np.nanmax(largest, initial=0.0)
    if worst > WIDE:
        axes.set_yscale("log")
    else:
        axes.set_ylim(0, 1.08 * max(1.1 * OVERSHOOT, worst))
    axes.set_title(f"{over or 'None'} of {count:,} steps above 2", **SUBTITLE)
    axes.set_ylabel(r"largest $\alpha\,\|\phi\|^2$ [-]")
    _by_episode(axes, records)


def _costs(noisy: Axes, free: Axes, records: Records, frozen: Records | None) -> None:
    """The cost of each training episode, and of the rollouts without noise."""
    for one in filter(None, (frozen, records)):
        learner = one.experiment["learner"]
        look = {**LOOKS[learner].line, "label": learner}
        cost = metrics.training_cost(one)
        mark: dict[str, Any] = (
            {"marker": "o", "markersize": 4} if np.isfinite(cost).sum() == 1 else {}
        )
        noisy.plot(_episode(cost), cost, lw=1.1, **look, **mark)
        episode, judged = metrics.noise_free_cost(one)
        known = np.isfinite(judged)
        free.plot(episode[known], judged[known], **look, marker="o", markersize=2.5)
    for axes, name in ((noisy, "cost with noise"), (free, "cost without noise")):
        logarithmic_if_wide([axes])
        axes.set_ylabel(name)
        _by_episode(axes, records)
    noisy.set_title(_against(records, frozen), **SUBTITLE)
    before, after = metrics.initial_cost(records), metrics.final_cost(records)
    ending = f"to {after:.0f}" if np.isfinite(after) else "on, cut short"
    free.set_title(f"Without noise, from {before:.0f} {ending}", **SUBTITLE)
    if not np.isfinite(metrics.training_cost(records)).any():
        noisy.annotate("no episode was finished", (0.5, 0.5), xycoords="axes fraction", ha="center")
        if frozen is None:
            noisy.set_yticks([])
    if frozen:
        noisy.legend(fontsize="small")


def _against(records: Records, frozen: Records | None) -> str:
    """The training cost at the end, as a multiple of the baseline's."""
    if frozen is None:
        return "Training, exploration included"
    ratio = metrics.cost_ratio(metrics.training_cost(records), metrics.training_cost(frozen))
    if not np.isfinite(ratio):
        return "Training, cut short"
    return f"Training: {ratio:.2f} of the baseline"


def _source(records: Records, frozen: Records | None) -> str:
    """Which run it is, and whether its baseline is drawn."""
    e = records.experiment
    without = frozen is None and e["learner"] != "frozen"
    return (
        f"{e['learner']}, layout {e['layout']}, {DECAY_TITLES[e['decay']]}, seed {e['seed']},"
        f" {_episodes(e['episodes'])}" + ("; its baseline is not stored" if without else "")
    )


def _by_episode(axes: Axes, records: Records) -> None:
    """The whole of training, even if it was stopped."""
    episodes = records.experiment["episodes"]
    axes.set(xlabel="episode", xlim=(-0.03 * episodes, 1.03 * episodes))
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))


def _episode(values: Vector) -> Vector:
    """1, 2, ... for one value an episode."""
    return np.arange(1.0, len(values) + 1)


def _known(states: Column) -> Column:
    """The states that were reached."""
    return states[np.isfinite(states).all(axis=1)]


def _episodes(count: int) -> str:
    return f"{count} episode{'' if count == 1 else 's'}"
