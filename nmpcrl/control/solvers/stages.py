"""The stages of a `Problem` in symbols, differentiated: the module `model` that `kernel` asks.

Horizon, discount, weights, bounds, data and the number of lines are arguments, so that one
compilation serves them all. Rows are *fixed*, or of each *line* of some data (`Soft.each`); their
derivatives are written at their nonzeros, and so are the products that fold them into a stage.
A function of all rows, as `measure_rows`, calls one of each. Arrays of rows hold those of all
stages; `at` says where those of the stage begin. A row that depends on u is absent at stage N, and
the u that is given there counts nothing. A stage's Lagrangian is discount l + costate' f + lam' h.
"""

from collections.abc import Iterator
from functools import partial

import casadi as ca
import numpy as np

from nmpcrl.control.codegen.source import INNER, source
from nmpcrl.control.problem import Problem

# SOFT rows belong to no line, FIXED with hard ones behind them, and PER to each line of data; OWN
# data of a stage belong to no line, and WIDTH to each.
HEADER = '''"""A problem's functions."""

import math

import numpy as np
from numba import njit

NX, NU, NTHETA = {sizes}
SOFT, FIXED, PER, OWN, WIDTH = {rows}
'''
ALL_ROWS = """{inner}def {name}_rows({fixed}, at, lines):
    {name}_fixed({fixed}, at)
    for line in range(lines):
        {name}_line({of_line})
"""
MATRICES = ("A", "B", "Q", "S", "R", "hx", "hu")
SPARSE = ("A", "B", "hx", "hu")
ADDED = ("px", "pu", "q", "r", "Q", "S", "R", "gradient")  # to what the array holds
BEGINS = {"line": "of", **dict.fromkeys(  # at which index of an array a stage's rows begin
    ("h", "size", "lam", "dlam", "hx", "hu", "stiff", "pull"), "at")}  # fmt: skip
DIRECTIONS = {"x": "dx", "u": "du", "costate": "dcostate", "theta": "w", "lam": "dlam"}
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
    made = [*functions(problem)]
    bodies = [INNER + _written(f) for f in made]
    bodies += [_of_all_rows(f) for f in made if f.name().endswith("_line")]
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


def _of_all_rows(f: ca.Function) -> str:
    """The text of a function of all rows of a stage, which calls one of a line's rows."""
    given = [*f.name_in(), *(f"{name}_" for name in f.name_out())]
    of_line = ["d" if name == "line" else name for name in given]
    begins = ["OWN + WIDTH * line"] * ("line" in given) + ["at + FIXED + PER * line"]
    return ALL_ROWS.format(
        inner=INNER,
        name=f.name().removesuffix("_line"),
        fixed=", ".join(name for name in given if name != "line"),
        of_line=", ".join(of_line + begins),
    )


def functions(problem: Problem) -> Iterator[ca.Function]:
    """Every function of `model`, with the names of its arguments."""
    e = problem.expressions
    n, z = e.x.numel(), ca.vertcat(e.x, e.u)
    discount, costate = ca.SX.sym("discount"), ca.SX.sym("costate", n)
    s = {"x": e.x, "u": e.u, "theta": e.theta, "d": e.d, "discount": discount, "costate": costate}
    s |= {to: ca.SX.sym(to, s[of].numel()) for of, to in DIRECTIONS.items() if of in s}
    made, along = partial(_function, s), partial(_along, s)
    point, end = "x u theta d", "x theta d"
    weighed, weighed_end = f"{point} discount costate", f"{end} discount"
    path, last = discount * e.stage + ca.dot(costate, e.next_x), discount * e.terminal
    hessian, slope = ca.hessian(path, z)
    bend_end, slope_end = ca.hessian(last, e.x)
    path_theta, last_theta, first_theta = (ca.gradient(f, e.theta) for f in (path, last, e.initial))
    of_stage, slopes = ca.gradient(discount * e.stage, z), ca.jacobian(e.next_x, z)
    expand = {"A": slopes[:, :n], "B": slopes[:, n:], "lx": of_stage[:n], "lu": of_stage[n:]}
    mixed = along(slope, "theta")

    yield made("transition", point, next_x=e.next_x)
    yield made("stage_cost", point, cost=e.stage)
    yield made("terminal_cost", end, cost=e.terminal)
    yield made("initial_cost", end, cost=e.initial)
    yield made("stage_size", point, cost=_size(e.stage, z))
    yield made("terminal_size", end, cost=_size(e.terminal, e.x))
    yield made("expand_stage", weighed, **expand, **_blocks(hessian, n))
    yield made("expand_terminal", weighed_end, lx=slope_end, Q=bend_end)
    yield made("stage_theta", weighed, gradient=path_theta)
    yield made("terminal_theta", weighed_end, gradient=last_theta)
    yield made("initial_theta", end, gradient=first_theta)
    of_theta = {"q": mixed[:n], "r": mixed[n:], "f": along(e.next_x, "theta")}
    yield made("stage_mixed", f"{weighed} w", **of_theta)
    yield made("terminal_mixed", f"{weighed_end} w", q=along(slope_end, "theta"))
    moved = along(path_theta, "x", "u", "costate", "theta")
    yield made("stage_along", f"{weighed} dx du dcostate w", gradient=moved)
    yield made("terminal_along", f"{weighed_end} dx w", gradient=along(last_theta, "x", "theta"))
    yield made("initial_along", f"{end} w", gradient=along(first_theta, "theta"))
    sizes = problem.row_sizes
    yield from _of_rows("fixed", s, e.fixed, sizes(e.fixed), point)
    yield from _of_rows("line", s | {"line": e.line}, e.each, sizes(e.each), f"{point} line")


def _of_rows(
    name: str, s: dict[str, ca.SX], rows: ca.SX, sizes: ca.SX, point: str
) -> Iterator[ca.Function]:
    """The functions of rows h."""
    n, z = s["x"].numel(), ca.vertcat(s["x"], s["u"])
    s = s | {to: ca.SX.sym(to, rows.numel()) for to in ("lam", "dlam", "stiff", "pull")}
    slopes, held = ca.jacobian(rows, z), ca.dot(s["lam"], rows)
    (s["hx"], Hx), (s["hu"], Hu) = _nonzeros("hx", slopes[:, :n]), _nonzeros("hu", slopes[:, n:])
    H, known = ca.horzcat(Hx, Hu), f"{point} lam"
    made, along = partial(_function, s), partial(_along, s)
    hessian, slope = ca.hessian(held, z)
    of_theta, mixed = ca.gradient(held, s["theta"]), along(slope, "theta")
    expand = {"hx": slopes[:, :n], "hu": slopes[:, n:], "px": slope[:n], "pu": slope[n:]}
    condensed = {"q": Hx.T @ s["pull"], "r": Hu.T @ s["pull"]}
    condensed |= _blocks(H.T @ ca.diag(s["stiff"]) @ H, n)
    of_along = along(of_theta, "x", "u", "lam", "theta")

    yield made(f"size_{name}", point, size=sizes)
    yield made(f"measure_{name}", point, h=rows)
    yield made(f"expand_{name}", known, **expand, **_blocks(hessian, n))
    yield made(f"condense_{name}", "stiff pull hx hu", **condensed)
    yield made(f"along_{name}", "hx hu dx du", h=Hx @ s["dx"] + Hu @ s["du"])
    yield made(f"theta_{name}", known, gradient=of_theta)
    yield made(f"mixed_{name}", f"{known} w", q=mixed[:n], r=mixed[n:], h=along(rows, "theta"))
    yield made(f"along_theta_{name}", f"{known} dx du dlam w", gradient=of_along)


def _blocks(hessian: ca.SX, n: int) -> dict[str, ca.SX]:
    """A Hessian in (x, u) by its blocks."""
    return {"Q": hessian[:n, :n], "S": hessian[n:, :n], "R": hessian[n:, n:]}


def _along(symbols: dict[str, ca.SX], of: ca.SX, *moved: str) -> ca.SX:
    """The derivative while each of these symbols moves along its direction."""
    variables = ca.vertcat(*(symbols[name] for name in moved))
    return ca.jtimes(of, variables, ca.vertcat(*(symbols[DIRECTIONS[name]] for name in moved)))


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


def _function(symbols: dict[str, ca.SX], name: str, given: str, **results: ca.SX) -> ca.Function:
    names = given.split()
    return ca.Function(
        name, [symbols[one] for one in names], [*results.values()], names, [*results]
    )
