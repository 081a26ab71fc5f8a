"""The stages of a `Problem` in symbols, differentiated: the module `model` that `kernel` asks.

Horizon, discount, weights, bounds, data and the number of lines are arguments, so that one
compilation serves them all. Rows are *fixed*, or of each *line* of some data (`Soft.each`); their
derivatives are written at their nonzeros, and so are the products that fold them into a stage.
"""

from collections.abc import Iterator

import casadi as ca
import numpy as np

from nmpcrl.control.codegen.source import INNER, source
from nmpcrl.control.problem import Problem

HEADER = '''"""A problem's functions."""

import math

import numpy as np
from numba import njit

NX, NU, NTHETA = {sizes}
SOFT, FIXED, PER, OWN, WIDTH = {rows}
'''
MATRICES = ("A", "B", "Q", "S", "R", "hx", "hu")
SPARSE = ("A", "B", "hx", "hu")
ADDED = ("px", "pu", "q", "r", "Q", "S", "R", "gradient")
BEGINS = {"line": "of", **dict.fromkeys(  # at which index of an array a stage's rows begin
    ("h", "size", "lam", "dlam", "hx", "hu", "stiff", "pull"), "at")}  # fmt: skip
STEEP = 100.0  # slope of a stage that counts as much as a curvature of 2, as of Ipopt


def write(problem: Problem) -> str:
    """The text of the module `model` for a problem.

    Raises:
        CannotCompile: an expression holds an operation that `codegen` does not know.
    """
    of = problem.expressions
    sizes = of.x.numel(), of.u.numel(), of.theta.numel()
    fixed = of.fixed.numel()
    soft = int(np.isfinite(problem.weights[:fixed]).sum())
    rows = soft, fixed, of.each.numel(), of.d.numel(), of.line.numel()
    bodies = [INNER + _written(f) for f in functions(problem)]
    return "\n\n".join([HEADER.format(sizes=sizes, rows=rows), *bodies])


def _written(f: ca.Function) -> str:
    """The text of a function of `model`."""
    names = [*f.name_in(), *f.name_out()]
    return source(
        f,
        returned=f.name_out() == ["cost"],
        matrices=MATRICES,
        sparse=SPARSE,
        added=ADDED,
        shifted={name: begin for name, begin in BEGINS.items() if name in names},
    )


def functions(problem: Problem) -> Iterator[ca.Function]:
    """Every function of `model`, with the names of its arguments."""
    e = problem.expressions
    x, u, theta, n = e.x, e.u, e.theta, e.x.numel()
    z = ca.vertcat(x, u)
    discount, costate = ca.SX.sym("discount"), ca.SX.sym("costate", n)
    dx, du, w = (ca.SX.sym(name, of.numel()) for name, of in (("dx", x), ("du", u), ("w", theta)))
    dcostate = ca.SX.sym("dcostate", n)
    point = {"x": x, "u": u, "theta": theta, "d": e.d}
    end = {"x": x, "theta": theta, "d": e.d}
    weighed = {**point, "discount": discount, "costate": costate}
    weighed_end = {**end, "discount": discount}
    path, last = discount * e.stage + ca.dot(costate, e.next_x), discount * e.terminal
    hessian, slope = ca.hessian(path, z)
    bend_end, slope_end = ca.hessian(last, x)
    moved = ((x, dx), (u, du), (costate, dcostate), (theta, w))
    path_theta, last_theta, first_theta = (ca.gradient(f, theta) for f in (path, last, e.initial))

    yield _function("transition", point, {"next_x": e.next_x})
    yield _function("stage_cost", point, {"cost": e.stage})
    yield _function("terminal_cost", end, {"cost": e.terminal})
    yield _function("initial_cost", end, {"cost": e.initial})
    yield _function("stage_size", point, {"cost": _size(e.stage, z)})
    yield _function("terminal_size", end, {"cost": _size(e.terminal, x)})
    of_stage = ca.gradient(discount * e.stage, z)
    slopes = ca.jacobian(e.next_x, z)
    expand = {"A": slopes[:, :n], "B": slopes[:, n:], "lx": of_stage[:n], "lu": of_stage[n:]}
    yield _function("expand_stage", weighed, expand | _blocks(hessian, n))
    yield _function("expand_terminal", weighed_end, {"lx": slope_end, "Q": bend_end})
    yield _function("stage_theta", weighed, {"gradient": path_theta})
    yield _function("terminal_theta", weighed_end, {"gradient": last_theta})
    yield _function("initial_theta", end, {"gradient": first_theta})
    mixed = ca.jtimes(slope, theta, w)
    of_theta = {"q": mixed[:n], "r": mixed[n:], "f": ca.jtimes(e.next_x, theta, w)}
    yield _function("stage_mixed", {**weighed, "w": w}, of_theta)
    yield _function(
        "terminal_mixed", {**weighed_end, "w": w}, {"q": ca.jtimes(slope_end, theta, w)}
    )
    steps = {"dx": dx, "du": du, "dcostate": dcostate, "w": w}
    yield _function("stage_along", {**weighed, **steps}, {"gradient": _along(path_theta, *moved)})
    yield _function(
        "terminal_along",
        {**weighed_end, "dx": dx, "w": w},
        {"gradient": _along(last_theta, (x, dx), (theta, w))},
    )
    yield _function(
        "initial_along", {**end, "w": w}, {"gradient": ca.jtimes(first_theta, theta, w)}
    )
    for name, rows, more in (("fixed", e.fixed, {}), ("line", e.each, {"line": e.line})):
        sizes = problem.row_sizes(rows)
        yield _function(f"{name}_sizes", {**point, **more}, {"size": sizes})
        yield from _of_rows(name, rows, {**point, **more}, (dx, du, w))


def _of_rows(
    name: str, rows: ca.SX, point: dict[str, ca.SX], steps: tuple[ca.SX, ca.SX, ca.SX]
) -> Iterator[ca.Function]:
    """The functions of rows h."""
    x, u, theta, n = point["x"], point["u"], point["theta"], point["x"].numel()
    dx, du, w = steps
    z = ca.vertcat(x, u)
    lam, dlam = ca.SX.sym("lam", rows.numel()), ca.SX.sym("dlam", rows.numel())
    held = ca.dot(lam, rows)
    hessian, slope = ca.hessian(held, z)
    slopes = ca.jacobian(rows, z)
    of_theta = ca.gradient(held, theta)
    known = {**point, "lam": lam}
    expand = {"hx": slopes[:, :n], "hu": slopes[:, n:], "px": slope[:n], "pu": slope[n:]}
    yield _function(f"{name}_rows", point, {"h": rows})
    yield _function(f"expand_{name}", known, expand | _blocks(hessian, n))
    hx, Hx = _nonzeros("hx", slopes[:, :n])
    hu, Hu = _nonzeros("hu", slopes[:, n:])
    stiff, pull = ca.SX.sym("stiff", rows.numel()), ca.SX.sym("pull", rows.numel())
    H, gradients = ca.horzcat(Hx, Hu), {"hx": hx, "hu": hu}
    yield _function(
        f"condense_{name}",
        {"stiff": stiff, "pull": pull, **gradients},
        {"q": Hx.T @ pull, "r": Hu.T @ pull, **_blocks(H.T @ ca.diag(stiff) @ H, n)},
    )
    yield _function(f"along_{name}", {**gradients, "dx": dx, "du": du}, {"h": Hx @ dx + Hu @ du})
    yield _function(f"theta_{name}", known, {"gradient": of_theta})
    mixed = ca.jtimes(slope, theta, w)
    yield _function(
        f"mixed_{name}",
        {**known, "w": w},
        {"q": mixed[:n], "r": mixed[n:], "h": ca.jtimes(rows, theta, w)},
    )
    yield _function(
        f"along_theta_{name}",
        {**known, "dx": dx, "du": du, "dlam": dlam, "w": w},
        {"gradient": _along(of_theta, (x, dx), (u, du), (lam, dlam), (theta, w))},
    )


def _blocks(hessian: ca.SX, n: int) -> dict[str, ca.SX]:
    """A Hessian in (x, u) by its blocks."""
    return {"Q": hessian[:n, :n], "S": hessian[n:, :n], "R": hessian[n:, n:]}


def _along(of: ca.SX, *moved: tuple[ca.SX, ca.SX]) -> ca.SX:
    """The derivative while each variable moves along its direction."""
    variables, directions = (ca.vertcat(*part) for part in zip(*moved, strict=True))
    return ca.jtimes(of, variables, directions)


def _size(cost: ca.SX, z: ca.SX) -> ca.SX:
    """Half of the largest curvature of a cost along an axis, or a share of its slope."""
    hessian, slope = ca.hessian(cost, z)
    return ca.fmax(ca.norm_inf(ca.diag(hessian)) / 2, ca.norm_inf(slope) / STEEP)


def _nonzeros(name: str, slopes: ca.SX) -> tuple[ca.SX, ca.SX]:
    """An argument for slopes, and these slopes: its entries where they are no constants."""
    argument = ca.SX.sym(name, *slopes.shape)
    found = ca.SX(slopes.sparsity())
    for i, j in zip(*slopes.sparsity().get_triplet(), strict=True):
        entry = slopes[i, j]
        found[i, j] = entry if entry.is_constant() else argument[i, j]
    return argument, found


def _function(name: str, of: dict[str, ca.SX], results: dict[str, ca.SX]) -> ca.Function:
    return ca.Function(name, [*of.values()], [*results.values()], [*of], [*results])
