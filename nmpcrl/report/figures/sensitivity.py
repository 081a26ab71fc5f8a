"""Figures of the value's gradient: what theta does to the optimum, and where it has a kink."""

import numpy as np
from matplotlib.ticker import MaxNLocator

from nmpcrl import Vector
from nmpcrl.report.figures.style import INK, TEAL, WINE, Drawn, page, subplots, titled


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
def gradient_errors(steps: Vector, forward: Vector, central: Vector) -> Drawn:
    """How far finite differences are from the envelope theorem's gradient.

    Args:
        steps: the step sizes, shape (k,).
        forward: relative error of forward differences, shape (k,).
        central: relative error of central differences, shape (k,).
    """
    figure, axes = subplots(height=3.4)
    axes.loglog(steps, forward, "s--", color=TEAL, ms=4, label="forward: 9 more solves")
    axes.loglog(steps, central, "o-", color=WINE, ms=4, label="central: 18 more solves")
    axes.set(
        xlabel="step in each component of θ (no unit)",
        ylabel="distance to the envelope\ngradient (relative)",
    )
    axes.legend()
    best = int(np.argmin(central))
    title = f"Differences agree to {central[best]:.0e}, if the step is near {steps[best]:.0e}"
    return titled(figure, title)


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
