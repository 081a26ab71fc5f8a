"""Figures of the controller: plans among obstacles, action values, and what each theta does."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.patches import Circle

from nmpcrl import Matrix, Vector
from nmpcrl.control import Solution, Task
from nmpcrl.learning.rollout import Rollout
from nmpcrl.report.figures.axes import below, draw_task, maps
from nmpcrl.report.figures.style import (
    INK,
    MEANINGS,
    TEAL,
    WINE,
    Drawn,
    page,
    shades,
    subplots,
    titled,
)


@page
def closed_loop(task: Task, rollout: Rollout, plans: Sequence[Solution]) -> Drawn:
    """The closed-loop trajectory without noise, and some of the plans behind it."""
    figure, axes = subplots(height=3.1)
    draw_task(axes, task)
    axes.plot(*rollout.states[:, :2].T, color=INK, lw=1.0, label="trajectory without noise")
    for i, plan in enumerate(plans):
        label = "plans" if i == 0 else None
        axes.plot(*plan.states[:, :2].T, ".-", color=WINE, lw=2.2, ms=5, label=label)
    below(figure, *axes.get_legend_handles_labels())
    axes.margins(0.04)
    farthest = max(_length(plan.states) for plan in plans)
    title = f"Plans of at most {farthest:.1f} m make a trajectory of"
    return titled(figure, f"{title} {_length(rollout.states):.1f} m")


@page
def receding_horizon(task: Task, rollout: Rollout, plans: Sequence[Solution]) -> Drawn:
    """Plans against the closed loop, around the plan that ends farthest from where the robot goes.

    Args:
        task: of the rollout.
        rollout: the closed loop.
        plans: those behind its first actions, in order; each ends within the rollout.
    """
    figure, axes = subplots(height=3.6)
    draw_task(axes, task, labels=False)
    path, horizon = rollout.states[:, :2], len(plans[0].inputs)
    ends = [np.array([p.states[-1, :2], path[i + horizon]]) for i, p in enumerate(plans)]
    apart = [float(np.linalg.norm(planned - reached)) for planned, reached in ends]
    farthest, every = int(np.argmax(apart)), max(1, horizon // 2)
    first = max(farthest % every, farthest - every)
    shown = range(first, min(farthest + horizon + 1, len(plans)), every)
    axes.plot(*path.T, ".-", color=INK, lw=1.0, ms=4, label="closed loop, a dot a step")
    for i in shown:
        names = ("plan", "the same time") if i == first else (None, None)
        planned = plans[i].states[:, :2].T
        axes.plot(*planned, "D-", color=WINE, lw=1.8, ms=4, markevery=[0], label=names[0])
        axes.plot(*ends[i].T, "o:", color=TEAL, ms=4.5, mfc="white", label=names[1])
    drawn = np.vstack([path[first : shown[-1] + horizon], *(plans[i].states[:, :2] for i in shown)])
    low, high = drawn.min(axis=0) - [0.3, 0.5], drawn.max(axis=0) + [0.3, 0.5]
    axes.set(xlabel="x [m]", ylabel="y [m]", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    below(figure, axes.get_legend_handles_labels()[0])
    title = f"The end of a plan is up to {apart[farthest]:.2f} m from the place"
    return titled(figure, f"{title} reached at that time")


@page
def action_values(
    speeds: Vector, turn_rates: Vector, values: Matrix, value: float, policy: Vector
) -> Drawn:
    """Q(s, a) over a grid of first actions, one line a speed, above the level V(s).

    Args:
        speeds: of the grid [m/s], shape (k,).
        turn_rates: of the grid [rad/s], shape (l,).
        values: Q(s, a), shape (l, k); nan where a solve failed.
        value: V(s).
        policy: the action of V(s), shape (2,).
    """
    figure, axes = subplots(height=3.6)
    for speed, column, shade in zip(speeds, values.T, shades(len(speeds))[::-1], strict=True):
        axes.plot(turn_rates, column, ".-", color=shade, label=f"Q at {speed:g} m/s")
    axes.axhline(value, color=WINE, ls="--", lw=1.2, label="V(s)")
    axes.plot(policy[1], value, "D", color=WINE, ms=7, label="the policy's action")
    axes.set(xlabel="turn rate of the first action [rad/s]", ylabel="value [cost]")
    below(figure, *axes.get_legend_handles_labels())
    return titled(figure, "Q equals V at the policy's action, and is no lower elsewhere")


SIDES: tuple[tuple[str, str, float, str], ...] = (  # of two changes: colour, line, and its words
    (TEAL, "-", 0.0, "left"),
    (WINE, "--", 1.0, "right"),
)


@page
def theta_effects(
    task: Task, middle: Rollout, others: Mapping[str, Mapping[str, Rollout]]
) -> Drawn:
    """One panel a parameter: the trajectory of theta_init, and of two other values.

    Args:
        task: of the rollouts.
        middle: the closed loop of theta_init.
        others: name of the parameter -> how it was changed -> closed loop; two changes each.
    """
    figure, by_name = maps(list(others), 1.5, 0.5)
    moved = {}
    for name, changes in others.items():
        axes = by_name[name]
        draw_task(axes, task, labels=False)
        _trajectory(axes, middle, INK, ":")
        for (change, rollout), (color, line, x, side) in zip(changes.items(), SIDES, strict=True):
            _trajectory(axes, rollout, color, line)
            where: dict[str, Any] = {"transform": axes.transAxes, "fontsize": "small"}
            axes.text(x, 0.03, f"{change}: {rollout.cost:.0f}", color=color, ha=side, **where)
        moved[name] = max(_apart(middle, rollout) for rollout in changes.values())
        axes.set_title(" ".join(MEANINGS[name]))
    bottom, top = axes.get_ylim()
    axes.set_ylim(bottom - 1, top)
    first, second, *_ = sorted(moved, key=lambda name: -moved[name])
    most = " and ".join("{} ({})".format(*MEANINGS[name]) for name in (first, second))
    return titled(figure, f"{most} bend the trajectory most")


@page
def printed_box(task: Task, repaired: Rollout, printed: Rollout, wall: float) -> Drawn:
    """The trajectory in the box of departure A, and in the box as the paper prints it."""
    figure, axes = subplots(height=3.2)
    draw_task(axes, task)
    axes.add_patch(Circle(tuple(task.target[:2]), task.near, fill=False, ec=INK, ls=":", lw=1))
    place = task.target[:2] + [0, task.near + 0.1]
    axes.text(*place, f"$d_t$ = {task.near:g} m", ha="center", va="bottom")
    axes.axvline(wall, color=WINE, lw=1)
    words: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "color": WINE}
    axes.text(wall, 1, f"wall at x = {wall:g} m ", ha="right", va="top", **words)
    axes.plot(*repaired.states[:, :2].T, color=INK, ls=":", label="box [−3, 9]² (used here)")
    axes.plot(*printed.states[:, :2].T, color=WINE, lw=2, label="box [−9, 3]² (as printed)")
    axes.margins(0.04)
    below(figure, *axes.get_legend_handles_labels())
    nearest = np.linalg.norm(printed.states[:, :2] - task.target[:2], axis=1).min()
    return titled(figure, f"In the printed box the robot comes no nearer than {nearest:.1f} m")


@page
def penalty_gap(task: Task, theta_c: Vector, costs: Vector) -> Drawn:
    """Where the RL penalty begins, where the NMPC keeps away, and what theta_c does about it.

    Args:
        task: supplies clearance, margin and penalty.
        theta_c: the values tried, the first one that of theta_init, shape (k,).
        costs: noise-free cost of each; infinite where a solve failed, shape (k,).
    """
    figure, (above, low) = subplots(2, 1, height=5.4)
    kept = task.discs[2][0] / 2  # centre distance at which Xi = 0 [m]
    distance = np.linspace(0.9 * kept, 1.25 * kept, 200)
    penalty = task.penalty * np.maximum(0, 1 - (distance / kept) ** 2 + task.margin)
    begins = kept * np.sqrt(1 + task.margin)
    keeps = kept * np.sqrt(1 + theta_c[0])
    above.plot(distance, penalty, color=INK)
    above.axvline(keeps, color=WINE, ls="--", label=f"the NMPC keeps {keeps:.3f} m")
    above.axvline(begins, color=TEAL, ls="-.", label=f"the penalty begins at {begins:.3f} m")
    above.set(xlabel="distance to a centre [m]", ylabel="penalty of a step [cost]")
    below(figure, above.get_legend_handles_labels()[0])
    order = np.argsort(theta_c)
    low.plot(theta_c[order], np.where(np.isfinite(costs), costs, np.nan)[order], "o-", color=INK)
    low.axvline(task.margin, color=TEAL, ls="-.", lw=1)
    low.set(xlabel=r"$\theta_c$ (no unit)", ylabel="noise-free RL cost")
    best = theta_c[np.argmin(costs)]
    return titled(
        figure, f"The penalty begins too early; $\\theta_c$ = {best:.2f} has the lowest cost"
    )


def _trajectory(axes: Any, rollout: Rollout, color: str, line: str) -> None:
    """The path, and an arrow for the heading at its end."""
    axes.plot(*rollout.states[:, :2].T, color=color, ls=line, lw=1.3)
    x, y, heading = rollout.states[-1]
    ahead = (x + 0.9 * np.cos(heading), y + 0.9 * np.sin(heading))
    axes.annotate("", ahead, (x, y), arrowprops={"arrowstyle": "->", "color": color})


def _length(states: Matrix) -> float:
    return float(np.linalg.norm(np.diff(states[:, :2], axis=0), axis=1).sum())


def _apart(a: Rollout, b: Rollout) -> float:
    """Largest distance [m] from a point of one trajectory to the nearest point of the other."""
    first, second = a.states[:, None, :2], b.states[None, :, :2]
    between = np.linalg.norm(first - second, axis=-1)
    return float(max(between.min(axis=0).max(), between.min(axis=1).max()))
