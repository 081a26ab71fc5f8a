"""Figures of the controller: plans among obstacles, values, their slopes, and what theta does."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator
from scipy.spatial.distance import directed_hausdorff

from nmpcrl import Matrix, Vector
from nmpcrl.control import Solution, Task
from nmpcrl.learning.rollout import Rollout
from nmpcrl.report.figures.axes import draw_task, panels
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
    axes.margins(0.04)
    farthest = max(_length(plan.states) for plan in plans)
    title = (
        f"Plans of at most {farthest:.1f} m make a trajectory of {_length(rollout.states):.1f} m"
    )
    return titled(figure, title, legend=axes)


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
    title = (
        f"The end of a plan is up to {apart[farthest]:.2f} m from the place reached at that time"
    )
    return titled(figure, title, legend=axes)


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
    title = "Q equals V at the policy's action, and is no lower elsewhere"
    return titled(figure, title, legend=axes)


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
    words = {" ".join(MEANINGS[name]): changes for name, changes in others.items()}
    figure, by_words = panels(list(words), 1.5, 0.5)
    for name, changes in words.items():
        axes = by_words[name]
        draw_task(axes, task, labels=False)
        _trajectory(axes, middle, INK, ":")
        for (change, rollout), (color, line, x, side) in zip(changes.items(), SIDES, strict=True):
            _trajectory(axes, rollout, color, line)
            where: dict[str, Any] = {"transform": axes.transAxes, "fontsize": "small"}
            axes.text(x, 0.03, f"{change}: {rollout.cost:.0f}", color=color, ha=side, **where)
    bottom, top = axes.get_ylim()
    axes.set_ylim(bottom - 1, top)
    moved = {
        name: max(_apart(middle, one) for one in each.values()) for name, each in others.items()
    }
    first, second, *_ = sorted(moved, key=lambda name: -moved[name])
    most = " and ".join("{} ({})".format(*MEANINGS[name]) for name in (first, second))
    return titled(figure, f"{most} bend the trajectory most")


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
    order = np.argsort(theta_c)
    low.plot(theta_c[order], np.where(np.isfinite(costs), costs, np.nan)[order], "o-", color=INK)
    low.axvline(task.margin, color=TEAL, ls="-.", lw=1)
    low.set(xlabel=r"$\theta_c$ (no unit)", ylabel="noise-free RL cost")
    best = theta_c[np.argmin(costs)]
    title = f"The penalty begins too early; $\\theta_c$ = {best:.2f} has the lowest cost"
    return titled(figure, title, legend=above)


@page
def one_variable(theta: Vector, values: Vector, at: float, slope: float) -> Drawn:
    """The value of min (x - theta)^2 subject to x >= 1, and its slope at one theta.

    Args:
        theta: where the problem was solved, shape (k,).
        values: its optimal value there, shape (k,).
        at: the theta of the tangent.
        slope: dV/dtheta there.
    """
    figure, axes = subplots(height=3.0)
    axes.plot(theta, values, color=INK, label=r"$V(\theta)$")
    near = np.array([at - 0.6, at + 0.6])
    axes.plot(near, np.interp(at, theta, values) + slope * (near - at), color=WINE, lw=2.2)
    axes.plot(at, np.interp(at, theta, values), "D", color=WINE, label=f"slope {slope:g}")
    axes.axvline(1, color=TEAL, ls="-.", lw=1, label="the constraint becomes inactive")
    axes.set(xlabel=r"$\theta$ (no unit)", ylabel="optimal value (no unit)")
    axes.legend()
    return titled(figure, "The value falls until the constraint becomes inactive")


@page
def shares_closed(pulls: Vector, shares: Vector, taken: float) -> Drawn:
    """How much of the TD error one update closes, against its alpha ||phi||^2.

    Args:
        pulls: alpha ||phi||^2, growing, shape (k,).
        shares: of the TD error, found by solving again, shape (k,).
        taken: the alpha ||phi||^2 of the update in the text.
    """
    figure, axes = subplots(height=3.2)
    closed = np.interp(taken, pulls, shares)
    axes.plot(pulls, shares, color=WINE, label="solved again with the new θ")
    axes.plot(pulls, pulls, "--", color=TEAL, label="to first order")
    axes.plot(taken, closed, "D", color=INK, label="the update in the text")
    axes.axhline(1, color=INK, ls=":", lw=1)
    axes.set(xlabel="α‖φ‖² (no unit)", ylabel="share of the TD error\nthat is closed (no unit)")
    axes.legend()
    return titled(figure, f"With α‖φ‖² = {taken:.2f} an update closes {closed:.2f} of the TD error")


@page
def kink(offsets: Vector, values: Vector, edge: float, slopes: tuple[float, float]) -> Drawn:
    """V against theta_c where the start crosses an obstacle's boundary.

    Args:
        offsets: theta_c - edge, shape (k,).
        values: V there, shape (k,).
        edge: the theta_c that puts the start on the boundary.
        slopes: dV/dtheta_c on the left and on the right of it.
    """
    figure, axes = subplots(height=3.3)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.plot(offsets, values - np.interp(0, offsets, values), "o", color=INK, ms=4, label="solved")
    for slope, side, color, line in zip(slopes, (-1, 1), (TEAL, WINE), ("--", "-"), strict=True):
        reach = np.array([0, side * np.abs(offsets).max()])
        axes.plot(reach, slope * reach, line, color=color, label=f"slope {slope:.1f}")
    axes.set(xlabel=rf"$\theta_c$ − {edge:.3f} (no unit)", ylabel="V − V at the boundary [cost]")
    axes.legend()
    return titled(figure, f"At the boundary the slope jumps by {slopes[1] - slopes[0]:.1f}")


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
    first, second = a.states[:, :2], b.states[:, :2]
    return max(float(directed_hausdorff(*two)[0]) for two in ((first, second), (second, first)))
