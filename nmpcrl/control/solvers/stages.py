"""The stages of Eq. (2) in symbols, differentiated: what `model` promises, for one plant.

Target, obstacles and discount are arguments, so that one compilation serves every task, horizon
and layout of a plant.
"""

import casadi as ca

from nmpcrl.control.codegen.source import source
from nmpcrl.control.ocp import Theta, stage_cost, terminal_cost
from nmpcrl.control.plant import Plant
from nmpcrl.control.task import overlap

HEADER = '''"""{about}"""

import math

import numpy as np
from numba import njit

NX, NU, NTHETA = {sizes}
'''


def write(plant: Plant) -> str:
    """The text of the module `model` for `plant`.

    Raises:
        CannotCompile: the plant's dynamics hold an operation that `codegen` does not know.
    """
    sizes = (plant.n, plant.m, 2 * plant.n + plant.m + 1)
    header = HEADER.format(about=", ".join(plant.state_names), sizes=sizes)
    bodies = [
        f'@njit(error_model="numpy", forceinline=True)\n{source(f)}' for f in functions(plant)
    ]
    return "\n\n".join([header, *bodies])


def functions(plant: Plant) -> list[ca.Function]:
    """Every function of `model`, as CasADi functions with the names of their arguments."""
    n, m = plant.n, plant.m
    x, u, theta = ca.SX.sym("x", n), ca.SX.sym("u", m), ca.SX.sym("theta", 2 * n + m + 1)
    target, disc = ca.SX.sym("target", n), ca.SX.sym("disc", 3)
    discount, costate = ca.SX.sym("discount"), ca.SX.sym("costate", n)
    dx, du = ca.SX.sym("dx", n), ca.SX.sym("du", m)
    w = ca.SX.sym("w", 2 * n + m + 1)
    weights = Theta.split(theta, n, m)

    step = plant.transition(x, u)
    cost = stage_cost(x, u, weights, target)
    end = terminal_cost(x, weights, target)
    path = overlap(x[0], x[1], disc[0], disc[1], disc[2]) + weights.constraint
    lagrangian = discount * cost + ca.dot(costate, step)
    hessian, _ = ca.hessian(lagrangian, ca.vertcat(x, u))
    expand = {
        "A": ca.jacobian(step, x),
        "B": ca.jacobian(step, u),
        "lx": ca.gradient(discount * cost, x),
        "lu": ca.gradient(discount * cost, u),
        "Q": hessian[:n, :n],
        "S": hessian[n:, :n],
        "R": hessian[n:, n:],
    }
    end_hessian, end_gradient = ca.hessian(discount * end, x)
    path_hessian, path_gradient = ca.hessian(path, x)

    def along(gradient: ca.SX, *moved: tuple[ca.SX, ca.SX]) -> ca.SX:
        """The derivative of a gradient while each variable moves along its direction."""
        variables, directions = (ca.vertcat(*part) for part in zip(*moved, strict=True))
        return ca.jtimes(gradient, variables, directions)

    cost_slope, end_slope, path_slope = (ca.gradient(f, theta) for f in (cost, end, path))
    stage = {"x": x, "u": u, "theta": theta, "target": target}
    last = {"x": x, "theta": theta, "target": target}
    obstacle = {"x": x, "theta": theta, "disc": disc}
    weighted = {**stage, "discount": discount, "costate": costate}
    return [
        _function("step", {"x": x, "u": u}, {"next_x": step}),
        _function("cost", stage, {"cost": cost}),
        _function("end", last, {"end": end}),
        _function("path", obstacle, {"path": path}),
        _function("expand", weighted, expand),
        _function(
            "expand_end", {**last, "discount": discount}, {"lx": end_gradient, "Q": end_hessian}
        ),
        _function("expand_path", obstacle, {"hx": path_gradient, "hxx": path_hessian}),
        _function("cost_slope", stage, {"slope": cost_slope}),
        _function("end_slope", last, {"slope": end_slope}),
        _function("path_slope", obstacle, {"slope": path_slope}),
        _function(
            "turn",
            {**stage, "w": w},
            {
                "lx": along(ca.gradient(cost, x), (theta, w)),
                "lu": along(ca.gradient(cost, u), (theta, w)),
            },
        ),
        _function("turn_end", {**last, "w": w}, {"lx": along(ca.gradient(end, x), (theta, w))}),
        _function("turn_path", {**obstacle, "w": w}, {"hx": along(path_gradient, (theta, w))}),
        _function(
            "bend",
            {**stage, "dx": dx, "du": du, "w": w},
            {"slope": along(cost_slope, (x, dx), (u, du), (theta, w))},
        ),
        _function(
            "bend_end",
            {**last, "dx": dx, "w": w},
            {"slope": along(end_slope, (x, dx), (theta, w))},
        ),
        _function(
            "bend_path",
            {**obstacle, "dx": dx, "w": w},
            {"slope": along(path_slope, (x, dx), (theta, w))},
        ),
    ]


def _function(name: str, of: dict[str, ca.SX], results: dict[str, ca.SX]) -> ca.Function:
    return ca.Function(name, [*of.values()], [*results.values()], [*of], [*results])
