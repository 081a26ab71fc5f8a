"""The stages of a `Problem` in symbols, differentiated: what `expressions` promises."""

import casadi as ca

from nmpcrl.control.codegen.source import INNER, source
from nmpcrl.control.problem import Problem

HEADER = '''"""A problem's functions."""

import math

import numpy as np
from numba import njit

NROWS = {rows}
'''
MODEL = '''"""What `kernel` asks of a plant, of which a problem has the sizes alone."""

NX, NU, NTHETA = {sizes}
transition = stage_cost = stage_gradient = terminal_cost = terminal_gradient = None
constraint = constraint_gradient = None
expand_stage = expand_terminal = expand_constraint = None
'''


MATRICES = ("A", "B", "Q", "S", "R", "hx", "hu")


def write(problem: Problem) -> dict[str, str]:
    """The texts of the modules `model` and `expressions` for a problem.

    Raises:
        CannotCompile: an expression holds an operation that `codegen` does not know.
    """
    sizes = (problem.states, problem.inputs, problem.names.size)
    bodies = [
        INNER + source(f, returned=f.name_out() == ["cost"], matrices=MATRICES)
        for f in functions(problem)
    ]
    header = HEADER.format(rows=problem.weights.size)
    return {
        "model": MODEL.format(sizes=sizes),
        "expressions": "\n\n".join([header, *bodies]),
    }


def functions(problem: Problem) -> list[ca.Function]:
    """Every function of `expressions`, as CasADi functions with the names of their arguments."""
    e = problem.expressions
    x, u, theta, d = e.x, e.u, e.theta, e.d
    discount, costate = ca.SX.sym("discount"), ca.SX.sym("costate", x.numel())
    lam, dlam = ca.SX.sym("lam", e.rows.numel()), ca.SX.sym("dlam", e.rows.numel())
    dx, du, w = (ca.SX.sym(name, of.numel()) for name, of in (("dx", x), ("du", u), ("w", theta)))
    dcostate = ca.SX.sym("dcostate", x.numel())
    at_end = ca.vertcat(
        ca.SX(0, 1), *(0 if on else e.rows[j] for j, on in enumerate(problem.on_inputs))
    )

    path = discount * e.stage + ca.dot(costate, e.next_x) + ca.dot(lam, e.rows)
    last = discount * e.terminal + ca.dot(lam, at_end)
    slope = ca.norm_inf(ca.vertcat(
        ca.gradient(e.stage, ca.vertcat(x, u)), ca.gradient(e.terminal, x)
    ))  # fmt: skip
    hessian, _ = ca.hessian(path, ca.vertcat(x, u))
    n = x.numel()

    def along(of: ca.SX, *moved: tuple[ca.SX, ca.SX]) -> ca.SX:
        """The derivative while each variable moves along its direction."""
        variables, directions = (ca.vertcat(*part) for part in zip(*moved, strict=True))
        return ca.jtimes(of, variables, directions)

    path_gradient, last_gradient, initial_gradient = (
        ca.gradient(f, theta) for f in (path, last, e.initial)
    )
    moved = ((x, dx), (u, du), (costate, dcostate), (lam, dlam), (theta, w))
    point = {"x": x, "u": u, "theta": theta, "d": d}
    end = {"x": x, "theta": theta, "d": d}
    held = {**point, "discount": discount, "costate": costate, "lam": lam}
    end_held = {**end, "discount": discount, "lam": lam}
    expand = {
        "A": ca.jacobian(e.next_x, x),
        "B": ca.jacobian(e.next_x, u),
        "lx": ca.gradient(discount * e.stage, x),
        "lu": ca.gradient(discount * e.stage, u),
        "Q": hessian[:n, :n],
        "S": hessian[n:, :n],
        "R": hessian[n:, n:],
        "hx": ca.jacobian(e.rows, x),
        "hu": ca.jacobian(e.rows, u),
    }
    expand_last = {
        "lx": ca.gradient(discount * e.terminal, x),
        "Q": ca.hessian(last, x)[0],
        "hx": ca.jacobian(at_end, x),
    }
    mixed = {
        "lx": along(ca.gradient(path, x), (theta, w)),
        "lu": along(ca.gradient(path, u), (theta, w)),
        "f": along(e.next_x, (theta, w)),
        "h": along(e.rows, (theta, w)),
    }
    last_mixed = {
        "lx": along(ca.gradient(last, x), (theta, w)),
        "h": along(at_end, (theta, w)),
    }
    path_along = along(path_gradient, *moved)
    last_along = along(last_gradient, (x, dx), (lam, dlam), (theta, w))
    steps = {"dx": dx, "du": du, "dcostate": dcostate, "dlam": dlam, "w": w}
    return [
        _function("transition", point, {"next_x": e.next_x}),
        _function("stage_cost", point, {"cost": e.stage}),
        _function("steepest", point, {"cost": slope}),
        _function("terminal_cost", end, {"cost": e.terminal}),
        _function("initial_cost", end, {"cost": e.initial}),
        _function("path_rows", point, {"h": e.rows}),
        _function("row_sizes", point, {"size": problem.row_sizes}),
        _function("last_rows", end, {"h": at_end}),
        _function("expand_stage", held, expand),
        _function("expand_last", end_held, expand_last),
        _function("stage_gradient", held, {"gradient": path_gradient}),
        _function("last_gradient", end_held, {"gradient": last_gradient}),
        _function("initial_gradient", end, {"gradient": initial_gradient}),
        _function("stage_mixed", {**held, "w": w}, mixed),
        _function("last_mixed", {**end_held, "w": w}, last_mixed),
        _function("stage_along", {**held, **steps}, {"gradient": path_along}),
        _function(
            "last_along", {**end_held, "dx": dx, "dlam": dlam, "w": w}, {"gradient": last_along}
        ),
        _function(
            "initial_along", {**end, "w": w}, {"gradient": along(initial_gradient, (theta, w))}
        ),
    ]


def _function(name: str, of: dict[str, ca.SX], results: dict[str, ca.SX]) -> ca.Function:
    return ca.Function(name, [*of.values()], [*results.values()], [*of], [*results])
