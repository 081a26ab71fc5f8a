"""Figures of the controller: plans among obstacles, action values, and what each theta does."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from nmpcrl import Matrix, Vector
from nmpcrl.control import Solution, Task
from nmpcrl.learning.rollout import Rollout
from nmpcrl.report.figures.axes import below, draw_task, map_grid
from nmpcrl.report.figures.style import (
    INK,
    MEANINGS,
    SYMBOLS,
    TEAL,
    WINE,
    headed,
    page,
    shades,
    subplots,
    symbol,
)


@page
def closed_loop(task: Task, rollout: Rollout, plans: Sequence[Solution]) -> Figure:
    """The closed-loop trajectory without noise, and some of the plans behind it."""
    figure, axes = subplots(height=3.1)
    draw_task(axes, task)
    axes.plot(*rollout.states[:, :2].T, color=INK, lw=1.0, label="trajectory without noise")
    for i, plan in enumerate(plans):
        label = "plans" if i == 0 else None
        axes.plot(*plan.states[:, :2].T, ".-", color=WINE, lw=2.2, ms=5, label=label)
    farthest = max((_length(plan.states) for plan in plans), default=0.0)
    axes.set(xlabel="x [m]", ylabel="y [m]")
    below(figure, *axes.get_legend_handles_labels())
    axes.margins(0.04)
    title = f"Plans of at most {farthest:.1f} m make a trajectory of"
    return headed(figure, f"{title} {_length(rollout.states):.1f} m")


@page
def receding_horizon(task: Task, rollout: Rollout, plans: Sequence[Solution]) -> Figure:
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
    axes.set_title(
        f"The end of a plan is up to {apart[farthest]:.2f} m from the place reached at that time"
    )
    below(figure, axes.get_legend_handles_labels()[0])
    return figure


@page
def action_values(
    speeds: Vector, turn_rates: Vector, values: Matrix, value: float, policy: Vector
) -> Figure:
    """Q(s, a) over a grid of first actions, one line a speed, above the level V(s).

    Args:
        speeds: of the grid [m/s], shape (k,).
        turn_rates: of the grid [rad/s], shape (l,).
        values: Q(s, a), shape (l, k); nan where a solve failed.
        value: V(s).
        policy: the action of V(s), shape (2,).
    """
    figure, axes = subplots(height=3.6)
    palest_first = shades(len(speeds))[::-1]
    for speed, column, shade in zip(speeds, values.T, palest_first, strict=True):
        axes.plot(turn_rates, column, ".-", color=shade, label=f"Q at {speed:g} m/s")
    axes.axhline(value, color=WINE, ls="--", lw=1.2, label="V(s)")
    axes.plot(policy[1], value, "D", color=WINE, ms=7, label="the policy's action")
    above = np.nanmin(values) > value - 1e-4
    axes.set(
        title="Q equals V at the policy's action, and is no lower elsewhere"
        if above
        else "Q falls below V: V was a local optimum",
        xlabel="turn rate of the first action [rad/s]",
        ylabel="value [cost]",
    )
    handles, labels = axes.get_legend_handles_labels()
    below(figure, handles, labels)
    return figure


@page
def theta_effects(
    task: Task, middle: Rollout, others: Mapping[str, Mapping[str, Rollout]]
) -> Figure:
    """One panel a parameter: the trajectory of theta_init, and of two other values.

    Args:
        task: of the rollouts.
        middle: the closed loop of theta_init.
        others: name of the parameter -> how it was changed -> closed loop; two changes each.
    """
    moved = {
        name: max(_apart(middle, rollout) for rollout in changes.values())
        for name, changes in others.items()
    }
    most = sorted(moved, key=lambda name: -moved[name])
    figure, maps, grid = map_grid(list(others), 1.5, 0.5)
    for name, changes in others.items():
        axes = maps[name]
        draw_task(axes, task, labels=False)
        _trajectory(axes, middle, INK, ":")
        for (change, rollout), side in zip(changes.items(), _SIDES, strict=False):
            _trajectory(axes, rollout, side["color"], side["line"])
            cost = f"{rollout.cost:.0f}" if np.isfinite(rollout.cost) else "fails"
            where = {"x": side["x"], "y": 0.03, "ha": side["ha"], "color": side["color"]}
            axes.text(s=f"{change}: {cost}", transform=axes.transAxes, fontsize="small", **where)
        title = f"${SYMBOLS[name]}$ {MEANINGS[name]}"
        axes.set_title(title, fontsize="medium", fontweight="normal")
    bottom, top = grid[0, 0].get_ylim()
    grid[0, 0].set_ylim(bottom - 1, top)
    for axes in grid[-1]:
        axes.set_xlabel("x [m]")
    for axes in grid[:, 0]:
        axes.set_ylabel("y [m]")
    first, second, *_ = most
    return headed(figure, f"{symbol(first)} and {symbol(second)} bend the trajectory most")


@page
def printed_box(task: Task, repaired: Rollout, printed: Rollout, wall: float) -> Figure:
    """The trajectory in the box of departure A, and in the box as the paper prints it."""
    figure, axes = subplots(height=3.2)
    draw_task(axes, task)
    axes.add_patch(Circle(tuple(task.target[:2]), task.near, fill=False, ec=INK, ls=":", lw=1))
    axes.annotate(
        f"$d_t$ = {task.near:g} m",
        task.target[:2] + [0, task.near],
        (0, 4),
        textcoords="offset points",
        ha="center",
        va="bottom",
    )
    axes.axvline(wall, color=WINE, lw=1)
    axes.annotate(
        f"wall at x = {wall:g} m ", (wall, 1), xycoords=("data", "axes fraction"),
        ha="right", va="top", color=WINE,
    )  # fmt: skip
    axes.plot(*repaired.states[:, :2].T, color=INK, ls=":", label="box [−3, 9]² (used here)")
    axes.plot(*printed.states[:, :2].T, color=WINE, lw=2, label="box [−9, 3]² (as printed)")
    nearest = np.linalg.norm(printed.states[:, :2] - task.target[:2], axis=1).min()
    axes.set(
        title=f"In the printed box the robot comes no nearer than {nearest:.1f} m",
        xlabel="x [m]",
        ylabel="y [m]",
    )
    axes.margins(0.04)
    below(figure, *axes.get_legend_handles_labels())
    return figure


@page
def penalty_gap(task: Task, theta_c: Vector, costs: Vector) -> Figure:
    """Where the RL penalty begins, where the NMPC keeps away, and what theta_c does about it.

    Args:
        task: supplies clearance, margin and penalty.
        theta_c: the values tried, the first one that of theta_init, shape (k,).
        costs: noise-free cost of each; infinite where a solve failed, shape (k,).
    """
    figure, (left, right) = subplots(1, 2, across=1, tall=5.4)
    kept = task.discs[2][0] / 2  # centre distance at which Xi = 0 [m]
    distance = np.linspace(0.9 * kept, 1.25 * kept, 200)
    penalty = task.penalty * np.maximum(0, 1 - (distance / kept) ** 2 + task.margin)
    begins = kept * np.sqrt(1 + task.margin)
    keeps = kept * np.sqrt(1 + theta_c[0])
    left.plot(distance, penalty, color=INK)
    left.axvline(keeps, color=WINE, ls="--", label=f"the NMPC keeps {keeps:.3f} m")
    left.axvline(begins, color=TEAL, ls="-.", label=f"the penalty begins at {begins:.3f} m")
    left.set(title="The penalty begins too early", xlabel="distance to a centre [m]")
    left.set_ylabel("penalty of a step [cost]")
    left.legend(loc="upper center", bbox_to_anchor=(0.45, -0.2))
    order = np.argsort(theta_c)
    right.plot(theta_c[order], np.where(np.isfinite(costs), costs, np.nan)[order], "o-", color=INK)
    right.axvline(task.margin, color=TEAL, ls="-.", lw=1)
    best = int(np.argmin(costs))
    right.set(
        title=f"$\\theta_c$ = {theta_c[best]:.2f} has the lowest cost",
        xlabel="$\\theta_c$ (no unit)",
        ylabel="noise-free RL cost",
    )
    return figure


_SIDES: tuple[dict[str, Any], ...] = (
    {"color": TEAL, "line": "-", "x": 0.0, "ha": "left"},
    {"color": WINE, "line": "--", "x": 1.0, "ha": "right"},
)  # of the first and of the second change


def _trajectory(axes: Axes, rollout: Rollout, color: str, line: str) -> None:
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
