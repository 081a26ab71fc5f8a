"""Figures of chapter 5 that are the paper's own, over seeds and layouts: learning curves, drives.

Costs are drawn in units of theta_init's cost without noise, so that layouts compare. What was cut
short, or never reached because the run was stopped, cost infinitely much: it counts in median and
quartiles, and leaves its panel through the upper edge.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, NullLocator, StrMethodFormatter

from nmpcrl import Vector
from nmpcrl.control import Task
from nmpcrl.study import metrics, paper
from nmpcrl.study.cards import WORDS
from nmpcrl.study.claims import divergence, instability
from nmpcrl.study.digest import Digest
from nmpcrl.study.evidence import Evidence
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.figures.controller import draw_task
from nmpcrl.study.figures.rdes import DECAYS, headed, label_panel
from nmpcrl.study.figures.style import LOOKS, marked, page, subplots
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.mechanisms import ending
from nmpcrl.study.records import Column
from nmpcrl.study.store import Study
from nmpcrl.study.verdicts import UNDECIDABLE, Verdict

LEARNED = ("RDES", "GES")  # the paper's two methods, whose policies its Figs. 3 and 4 show
SHOWN = ("frozen", *LEARNED)
LIMIT: dict[str, Any] = {"color": "0.4", "linewidth": 0.8, "linestyle": (0, (2, 2))}
SUBTITLE: dict[str, Any] = {"loc": "left", "fontsize": "medium", "fontweight": "normal"}
QUARTILES = (0.25, 0.5, 0.75)
CEILING = 4.0  # times theta_init's cost without noise, where the panels end
Curve = Callable[[Digest], tuple[Vector, Vector]]  # episodes and costs


def figure_1(found: Evidence, layout: str) -> Figure:
    """Fig. 1 of the paper: DES against RDES."""
    drawn = part(found, ("DES", "RDES", "frozen"), layout)
    counts = _counted(drawn, divergence, ("DES", "RDES"))
    return _learning_curves(drawn, f"Divergence in layout {layout}: {counts} runs")


def figure_2(found: Evidence, layout: str) -> Figure:
    """Fig. 2 of the paper: ES against GES."""
    drawn = part(found, ("ES", "GES", "frozen"), layout)
    counts = _counted(drawn, instability, ("ES", "GES"))
    return _learning_curves(drawn, f"Instability in layout {layout}: {counts} runs")


@page
def by_layout(found: Evidence, learners: tuple[str, ...], verdict: Verdict) -> Figure:
    """Cost without noise in every layout, a row a reading, and what the claim came to there."""
    drawn = part(found, learners)
    layouts, decays = found.digests.values_of("layout"), found.digests.values_of("decay")
    options = {"sharex": True, "sharey": True, "squeeze": False}
    figure, axes = subplots(len(decays), len(layouts), 1.6 * len(decays) + 1.1, **options)
    for column, layout in zip(axes.T, layouts, strict=True):
        for axis, decay in zip(column, decays, strict=True):
            runs = drawn.digests.select(layout=layout, decay=decay)
            _costs(axis, runs, learners, judged)
        word = WORDS[verdict.by_layout.get(layout, UNDECIDABLE)]
        column[0].set_title(f"{layout}: {word}", fontsize="medium", fontweight="normal")
        label_panel(column[-1])
        column[0].set_title(f"{layout}: {word}", fontsize="medium", fontweight="normal")
    axes[0, 0].xaxis.set_major_locator(MaxNLocator(2, integer=True))
    for axis, decay in zip(axes[:, 0], decays, strict=True):
        axis.set_ylabel(f"cost / at the start\n(noise per {decay})", fontsize="small")
    _cut(axes)
    _legend(figure, learners)
    return _finished(figure, f"Does {verdict.claim} hold? {_spelled(verdict)}", drawn)


@page
def controls(found: Evidence, layout: str) -> Figure:
    """Fig. 3 of the paper: the inputs under the learned policies, without noise.

    Drives whose inputs are not kept, as those of published runs, are left out.
    """
    drawn = _driving(part(found, SHOWN, layout))
    drawn = drawn.where([digest.actions.size > 0 for digest in drawn.digests.values()])
    plant = paper.nmpc(layout).plant
    figure, axes = _against_time(drawn, "actions", plant.action_names, 4.2)
    for i, row in enumerate(axes):
        for axis in row:
            axis.axhline(plant.lower[i], **LIMIT)
            axis.axhline(plant.upper[i], **LIMIT)
    learned = _learned(drawn)
    outside = sum(metrics.input_violations(d.actions, plant.lower, plant.upper) for d in learned)
    verb = f"{outside} inputs leave" if outside else "all inputs keep within"
    return _finished(
        figure, f"In {len(learned)} drives of RDES and GES, {verb} their bounds", drawn
    )


@page
def states(found: Evidence, layout: str) -> Figure:
    """Fig. 4 of the paper against time: the states under the learned policies."""
    drawn = _driving(part(found, SHOWN, layout))
    task, plant = paper.task(layout), paper.nmpc(layout).plant
    figure, axes = _against_time(drawn, "states", plant.state_names, 5.4)
    for i, row in enumerate(axes):
        for axis in row:
            axis.axhline(task.target[i], **LIMIT)
    ends = np.array([task.distance(digest.states[-1]) for digest in _learned(drawn)])
    arrived = int((ends <= ARRIVED).sum())
    title = f"{arrived} of {ends.size} drives of RDES and GES end at the target"
    return _finished(figure, f"In layout {layout}, {title}", drawn)


@page
def paths(found: Evidence, layout: str) -> Figure:
    """Fig. 4 of the paper in the plane: where the learned policies drive, without noise.

    One line a run and none for the median, for a median of places is no place that a robot was.
    """
    drawn = part(found, SHOWN, layout)
    driving, decays = _driving(drawn), drawn.digests.values_of("decay")
    figure, axes = subplots(1, len(decays), 3.5, sharey=True, squeeze=False)
    for axis, decay in zip(axes[0], decays, strict=True):
        _map(axis, paper.task(layout), driving.digests.select(decay=decay))
        axis.set_title(DECAYS[decay], **SUBTITLE)
        axis.set_xlabel("x [m]")
    axes[0, 0].set_ylabel("y [m]")
    _legend(figure, SHOWN)
    return _finished(figure, f"In layout {layout}: {_endings(_learned(drawn))}", drawn)


@page
def maps(found: Evidence) -> Figure:
    """Where the learned policies drive in every layout, both readings of the decay."""
    drawn = part(found, SHOWN)
    layouts = drawn.digests.values_of("layout")
    columns = min(3, len(layouts))
    rows = -(-len(layouts) // columns)
    figure, axes = subplots(
        rows, columns, 1.95 * rows + 0.8, sharex=True, sharey=True, squeeze=False
    )
    for axis, layout in zip(axes.flat, layouts, strict=False):
        runs = _driving(drawn).digests.select(layout=layout)
        _map(axis, paper.task(layout), runs, names=False)
        axis.set_title(layout, **SUBTITLE)
    for axis in axes.flat[len(layouts) :]:
        axis.set_axis_off()
    for axis in axes[-1]:
        axis.set_xlabel("x [m]")
    for axis in axes[:, 0]:
        axis.set_ylabel("y [m]")
    _legend(figure, SHOWN)
    return _finished(figure, f"In all layouts: {_endings(_learned(drawn))}", drawn)


@page
def twins(nudges: Mapping[Experiment, Vector], solvers: Vector, start: float) -> Figure:
    """How far twins are apart against episodes; `nudges` by run, `solvers` for riccati and Ipopt.

    Both hold `twins.separation`, a number an episode; `start` is how far apart the nudged begin.
    """
    decays = tuple(dict.fromkeys(e.decay for e in nudges))
    figure, axes = subplots(1, len(decays), 3.4, sharex=True, sharey=True, squeeze=False)
    for axis, decay in zip(axes[0], decays, strict=True):
        for experiment, apart in nudges.items():
            if experiment.decay == decay:
                _separation(axis, apart, **_line(experiment.learner))
        axis.axhline(start, **LIMIT)
        axis.set(yscale="log")
        label_panel(axis, decay)
    _separation(axes[0, 0], solvers, color="0.45", linewidth=2.4)
    axes[0, 0].set_ylabel("largest difference in θ")
    learners = tuple(dict.fromkeys(experiment.learner for experiment in nudges))
    other = Line2D([], [], color="0.45", linewidth=2.4, label="ES, riccati and Ipopt")
    _legend(figure, learners, other)
    grown = sorted({e.learner for e, apart in nudges.items() if apart[-1] > start})
    title = "Of all learners' twins, none end further apart than they began"
    if grown:
        title = f"A difference of {start:.0e} grows in runs of {' and '.join(grown)}"
    return headed(figure, title)


def part(found: Evidence, learners: tuple[str, ...], layout: str | None = None) -> Evidence:
    """The runs of some learners, in one layout or in all, learner by learner."""
    kept = found.runs.learner.isin(learners)
    return found.where(kept & (found.runs.layout == layout) if layout else kept)


def trained(digest: Digest) -> tuple[Vector, Vector]:
    """Cost of each episode of training, noise included, in units of the start's without noise."""
    cost = np.nan_to_num(digest.episodes["cost"], nan=np.inf)
    return np.arange(1.0, cost.size + 1), cost / digest.evaluations["cost"][0]


def judged(digest: Digest) -> tuple[Vector, Vector]:
    """Cost of each rollout without noise, in units of the first; infinite where training ended."""
    episodes, every = digest.experiment["episodes"], digest.experiment["evaluate_every"]
    due = np.unique([*range(0, episodes + 1, every), episodes]).astype(float)
    known = dict(zip(digest.evaluations["episode"], digest.evaluations["cost"], strict=True))
    return due, np.array([known.get(k, np.inf) for k in due]) / known[0]


@page
def _learning_curves(drawn: Evidence, title: str) -> Figure:
    """Cost of each training episode above, without noise below; a column a reading."""
    learners, decays = drawn.digests.values_of("learner"), drawn.digests.values_of("decay")
    options = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, axes = subplots(2, len(decays), 5.4, **options)
    for (above, below), decay in zip(axes.T, decays, strict=True):
        runs = drawn.digests.select(decay=decay)
        _costs(above, runs, learners, trained)
        _costs(below, runs, learners, judged)
        label_panel(above, decay, xlabel="")
        label_panel(below)
    axes[0, 0].set_ylabel("cost of a training episode\n/ at the start, without noise")
    axes[1, 0].set_ylabel("cost without noise\n/ at the start")
    _cut(axes)
    _legend(figure, learners)
    return _finished(figure, title, drawn)


def _costs(axis: Axes, runs: Study[Digest], learners: Iterable[str], curve: Curve) -> None:
    """Every learner's runs on a logarithmic axis of cost that ends at `CEILING`."""
    for learner in learners:
        curves = [curve(digest) for digest in runs.select(learner=learner).values()]
        if curves:
            costs = np.array([cost for _, cost in curves])
            _bundle(axis, curves[0][0], np.minimum(costs, 2 * CEILING), learner)
    axis.set_yscale("log")
    axis.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axis.yaxis.set_minor_locator(NullLocator())
    axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))


def _cut(axes: Column) -> None:
    """End the panels at `CEILING`, once all is drawn that may stretch them."""
    for axis in axes.flat:
        axis.set_ylim(None, min(CEILING, axis.get_ylim()[1]))


def _against_time(
    drawn: Evidence, name: str, components: tuple[str, ...], height: float
) -> tuple[Figure, Column]:
    """`states` or `actions` of the last rollouts: a row a component, a column a reading."""
    decays, period = drawn.digests.values_of("decay"), paper.nmpc().plant.period
    options = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, axes = subplots(len(components), max(1, len(decays)), height, **options)
    for column, decay in zip(axes.T, decays, strict=False):
        for learner in SHOWN:
            runs = drawn.digests.select(learner=learner, decay=decay).values()
            driven = np.array([getattr(digest, name) for digest in runs])
            for i, axis in enumerate(column if driven.size else ()):
                _bundle(axis, period * np.arange(driven.shape[1]), driven[:, :, i], learner)
        column[0].set_title(DECAYS[decay], **SUBTITLE)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    for axis, component in zip(axes[:, 0], components, strict=True):
        axis.set_ylabel(component)
    _legend(figure, SHOWN)
    return figure, axes


def _bundle(axis: Axes, along: Column, runs: Column, learner: str) -> None:
    """A learner's runs, shape (runs, points): each thin, their quartiles a band, the median thick.

    Values that are not known, after a failed solve, are left out.
    """
    color = LOOKS[learner].color
    axis.plot(along, runs.T, color=color, linewidth=0.5, alpha=0.35)
    known = np.isfinite(runs).any(axis=0)
    low, middle, high = np.full((3, along.size), np.nan)
    low[known], middle[known], high[known] = np.nanquantile(runs[:, known], QUARTILES, axis=0)
    axis.fill_between(along, low, high, color=color, alpha=0.15, linewidth=0)
    axis.plot(along, middle, **_line(learner))


def _map(axis: Axes, task: Task, runs: Study[Digest], *, names: bool = True) -> None:
    """Obstacles, start, target and drives; a mark where each drive ended."""
    draw_task(axis, task, labels=names)
    for learner in SHOWN:
        look = LOOKS[learner]
        for digest in runs.select(learner=learner).values():
            known = digest.states[np.isfinite(digest.states).all(axis=1)]
            axis.plot(known[:, 0], known[:, 1], **look.line, linewidth=0.9, alpha=0.7)
            axis.plot(*known[-1, :2], look.marker, color=look.color, markersize=3.5)
    axis.set(xlim=(task.lower[0], task.upper[0]), ylim=(-3, 6))


def _separation(axis: Axes, apart: Vector, **line: Any) -> None:
    axis.plot(np.arange(1, apart.size + 1), apart, **line)


def _line(learner: str) -> dict[str, Any]:
    return {**LOOKS[learner].line, "linewidth": 1.6}


def _learned(drawn: Evidence) -> list[Digest]:
    """Every run of the paper's two methods."""
    return [digest for e, digest in drawn.digests.items() if e.learner in LEARNED]


def _driving(found: Evidence) -> Evidence:
    """Without the runs that had to be stopped, which left no policy to drive with."""
    return found.where(found.runs.stopped == "finished")


def _endings(digests: list[Digest]) -> str:
    """How many drives of runs end in which way, the most common first."""
    ends = Counter(
        ending(one.states, paper.task(one.name.layout))
        if one.facts["stopped"] == "finished"
        else "stopped in training"
        for one in digests
    )
    return ", ".join(f"{count} {name}" for name, count in ends.most_common())


def _spelled(verdict: Verdict) -> str:
    """Which layouts say what: "no in A and D, yes in B"."""
    said: dict[str, list[str]] = {}
    for layout, outcome in verdict.by_layout.items():
        said.setdefault(WORDS[outcome], []).append(layout)
    return "; ".join(f"{word} in {', '.join(layouts)}" for word, layouts in said.items())


def _counted(
    drawn: Evidence, measure: Callable[[pd.DataFrame], pd.Series], learners: tuple[str, ...]
) -> str:
    """In how many of each learner's runs a measure of `claims` holds."""
    judged_runs = {name: measure(drawn.runs[drawn.runs.learner == name]) for name in learners}
    return ", ".join(
        f"{name} in {holds.sum()} of {len(holds)}" for name, holds in judged_runs.items()
    )


def _legend(figure: Figure, learners: Iterable[str], *others: Line2D) -> None:
    handles = [Line2D([], [], label=name, **_line(name)) for name in learners]
    handles += others
    figure.legend(handles=handles, loc="outside lower left", ncols=len(handles))


def _finished(figure: Figure, title: str, drawn: Evidence) -> Figure:
    return marked(headed(figure, title), drawn.mark)
