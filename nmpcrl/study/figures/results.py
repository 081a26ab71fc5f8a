"""Figures of chapter 5: the learned policies at the wheel, Figs. 3 and 4 of the paper.

Figs. 1 and 2 are with the chapters that explain them: `rdes.figure_1` and `ges.figure_2`.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from nmpcrl import Vector
from nmpcrl.control import Task
from nmpcrl.study import metrics, paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.figures.rdes import DECAYS, headed, thin
from nmpcrl.study.figures.style import LOOKS, PAGE, page, subplots
from nmpcrl.study.records import Column, Records
from nmpcrl.study.store import Study

LEARNED = ("RDES", "GES")  # the paper's two methods, whose policies its Figs. 3 and 4 show
SHOWN = ("frozen", *LEARNED)
LIMIT = {"color": "0.4", "linewidth": 0.8, "linestyle": (0, (2, 2))}
SUBTITLE = {"loc": "left", "fontsize": "medium", "fontweight": "normal"}
CUT_SHORT = "A learned policy does not drive to the end"


def controls(study: Study) -> Figure:
    """Fig. 3 of the paper: the inputs under the learned policies, without noise."""
    plant = paper.nmpc().plant
    actions = [metrics.final_rollout(records)[1] for records in _learned(study)]
    outside = sum(metrics.input_violations(a, plant.lower, plant.upper) for a in actions)
    figure, axes = _against_time(study, 1, plant.action_names, height=4.2)
    for i, row in enumerate(axes):
        for axis in row:
            axis.axhline(plant.lower[i], **LIMIT)
            axis.axhline(plant.upper[i], **LIMIT)
    found = f"{outside} inputs leave" if outside else "All inputs keep within"
    return _finished(figure, f"{found} their bounds")


def states(study: Study) -> Figure:
    """Fig. 4 of the paper against time: the states under the learned policies."""
    task, plant = _task(study), paper.nmpc().plant
    figure, axes = _against_time(study, 0, plant.state_names, height=5.6)
    for i, row in enumerate(axes):
        for axis in row:
            axis.axhline(task.target[i], **LIMIT)
    ends = np.array([metrics.final_rollout(records)[0][-1] for records in _learned(study)])
    left = np.linalg.norm((ends - task.target)[:, :2], axis=1).max()
    if not np.isfinite(left):
        return _finished(figure, CUT_SHORT)
    centimetres = max(1, int(np.ceil(100 * left)))
    return _finished(figure, f"The learned policies end within {centimetres} cm of the target")


def paths(study: Study) -> Figure:
    """Fig. 4 of the paper in the plane: where the learned policies drive, without noise."""
    decays = study.values_of("decay")
    figure, axes = subplots(len(decays), 1, 2.75 * len(decays) + 0.6, squeeze=False)
    for axis, decay in zip(axes[:, 0], decays, strict=True):
        _scene(axis, _task(study))
        for learner, records in _runs(study, decay):
            driven, _ = metrics.final_rollout(records)
            axis.plot(driven[:, 0], driven[:, 1], **thin(learner))
        axis.set_title(DECAYS[decay], **SUBTITLE)
    axes[-1, 0].set_xlabel("x [m]")
    apart = _apart(study)
    found = f"Side by side, the robots of RDES and GES come to be up to {apart:.2f} m apart"
    return _finished(figure, found if np.isfinite(apart) else CUT_SHORT)


@page
def twins(nudges: Mapping[Experiment, Vector], solvers: Vector, start: float) -> Figure:
    """How far twins are apart against episodes; `nudges` by run, `solvers` for riccati and Ipopt.

    Both hold `twins.separation`, one number a step; `start` is how far apart the nudged ones begin.
    """
    decays = tuple(dict.fromkeys(e.decay for e in nudges))
    figure, axes = subplots(1, len(decays), 3.4, sharex=True, sharey=True, squeeze=False)
    for axis, decay in zip(axes[0], decays, strict=True):
        for experiment, apart in nudges.items():
            if experiment.decay == decay:
                _envelope(axis, apart, experiment.steps, **thin(experiment.learner))
        axis.axhline(start, **LIMIT)
        axis.set_title(DECAYS[decay], **SUBTITLE)
        axis.set(xlabel="episode", yscale="log")
    steps = next(iter(nudges)).steps
    _envelope(axes[0, 0], solvers, steps, color="0.45", linewidth=2.4, linestyle="-")
    axes[0, 0].set_ylabel("largest difference in θ")
    learners = dict.fromkeys(experiment.learner for experiment in nudges)
    handles = [Line2D([], [], label=name, **LOOKS[name].line) for name in learners]
    handles.append(Line2D([], [], color="0.45", linewidth=2.4, label="ES, riccati and Ipopt"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    grown = sorted({e.learner for e, apart in nudges.items() if apart[-1] > start})
    found = "Of all learners' twins, none end further apart than they began"
    if grown:
        found = f"A difference of {start:.0e} grows in runs of {' and '.join(grown)}"
    return headed(figure, found)


def _envelope(axis: Axes, apart: Vector, steps: int, **line: Any) -> None:
    """The largest difference in each episode."""
    whole = apart[: len(apart) // steps * steps].reshape(-1, steps)
    axis.plot(np.arange(1, len(whole) + 1), whole.max(axis=1), **line)


def _against_time(
    study: Study, which: int, names: tuple[str, ...], height: float
) -> tuple[Figure, Column]:
    """States (0) or actions (1) of the last rollouts: a row a component, a column a reading."""
    decays, period = study.values_of("decay"), paper.nmpc().plant.period
    options = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, axes = subplots(len(names), len(decays), height, **options)
    for column, decay in zip(axes.T, decays, strict=True):
        for learner, records in _runs(study, decay):
            values = metrics.final_rollout(records)[which]
            for axis, component in zip(column, values.T, strict=True):
                held = "steps-post" if which else "default"  # an input is held for a period
                time = period * np.arange(component.size)
                axis.plot(time, component, drawstyle=held, **thin(learner))
        column[0].set_title(DECAYS[decay], **SUBTITLE)
        column[-1].set_xlabel("time [s]")
    for axis, name in zip(axes[:, 0], names, strict=True):
        axis.set_ylabel(name)
    return figure, axes


def _runs(study: Study, decay: str) -> Iterator[tuple[str, Records]]:
    """The runs of one reading whose policies are drawn, the control arm below."""
    for learner in SHOWN:
        for records in study.select(learner=learner, decay=decay).values():
            yield learner, records


def _learned(study: Study) -> list[Records]:
    """Every run of the paper's two methods."""
    return [records for learner in LEARNED for records in study.select(learner=learner).values()]


def _apart(study: Study) -> float:
    """How far the robots of RDES and GES come to be apart [m], over all pairs; nan if one fails."""
    distances = []
    for experiment, rdes in study.select(learner="RDES").items():
        noise = {"decay": experiment.decay, "seed": experiment.seed}
        distances += [
            metrics.path_distance(rdes, ges)
            for ges in study.select(learner="GES", **noise).values()
        ]
    return float(np.max(distances))


def _scene(axis: Axes, task: Task) -> None:
    """Obstacles, start and target; a metre is as long on both axes."""
    for x, y, clearance in zip(*task.discs, strict=True):
        reach, body = clearance / 2, (clearance - task.robot_diameter) / 2
        axis.add_patch(Circle((x, y), reach, fill=False, edgecolor="0.5", linestyle=(0, (2, 2))))
        axis.add_patch(Circle((x, y), body, facecolor="0.85", edgecolor="0.5"))
    for point, name, marker in ((task.start, "start", "o"), (task.target, "target", "*")):
        x, y = point[:2]
        axis.plot(x, y, marker, color="black", markersize=8 if marker == "*" else 5)
        axis.annotate(name, (x, y), (0, 8), textcoords="offset points", ha="center")
    axis.set(aspect="equal", ylabel="y [m]", xlim=(task.lower[0], task.upper[0]))


def _task(study: Study) -> Task:
    (layout,) = study.values_of("layout")
    return paper.task(layout)


def _finished(figure: Figure, finding: str) -> Figure:
    handles = [Line2D([], [], label=name, **LOOKS[name].line) for name in SHOWN]
    with plt.rc_context(PAGE):
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
        return headed(figure, finding)
