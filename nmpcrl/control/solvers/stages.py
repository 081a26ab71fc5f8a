"""The stages of Eq. (2) in symbols, differentiated: what `model` promises, for one plant.

Target, obstacles and discount are arguments, so that one compilation serves every task, horizon
and layout of a plant.
"""

import casadi as ca

from nmpcrl.control.codegen.source import INNER, source
from nmpcrl.control.ocp import Theta, stage_cost, terminal_cost
from nmpcrl.control.plant import Plant
from nmpcrl.control.task import overlap

HEADER = '''"""{about}"""

import math

import numpy as np
from numba import njit

NX, NU, NTHETA = {sizes}
'''


RETURNED = ("stage_cost", "terminal_cost", "constraint")
MATRICES = ("A", "B", "Q", "S", "R", "hxx")


def write(plant: Plant) -> str:
    """The text of the module `model` for `plant`.

    Raises:
        CannotCompile: the plant's dynamics hold an operation that `codegen` does not know.
    """
    sizes = (plant.n, plant.m, 2 * plant.n + plant.m + 1)
    header = HEADER.format(about=", ".join(plant.state_names), sizes=sizes)
    bodies = [
        INNER + source(f, returned=f.name() in RETURNED, matrices=MATRICES)
        for f in functions(plant)
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

    next_x = plant.transition(x, u)
    cost = stage_cost(x, u, weights, target)
    terminal = terminal_cost(x, weights, target)
    plane = x if n > 1 else ca.vertcat(x, 0)  # where no obstacle stands
    constraint = overlap(plane[0], plane[1], disc[0], disc[1], disc[2]) + weights.constraint
    lagrangian = discount * cost + ca.dot(costate, next_x)
    hessian, _ = ca.hessian(lagrangian, ca.vertcat(x, u))
    expand = {
        "A": ca.jacobian(next_x, x),
        "B": ca.jacobian(next_x, u),
        "lx": ca.gradient(discount * cost, x),
        "lu": ca.gradient(discount * cost, u),
        "Q": hessian[:n, :n],
        "S": hessian[n:, :n],
        "R": hessian[n:, n:],
    }
    terminal_hessian, lx = ca.hessian(discount * terminal, x)
    constraint_hessian, hx = ca.hessian(constraint, x)

    def along(gradient: ca.SX, *moved: tuple[ca.SX, ca.SX]) -> ca.SX:
        """The derivative of a gradient while each variable moves along its direction."""
        variables, directions = (ca.vertcat(*part) for part in zip(*moved, strict=True))
        return ca.jtimes(gradient, variables, directions)

    stage_gradient, terminal_gradient, constraint_gradient = (
        ca.gradient(f, theta) for f in (cost, terminal, constraint)
    )
    stage = {"x": x, "u": u, "theta": theta, "target": target}
    last = {"x": x, "theta": theta, "target": target}
    obstacle = {"x": x, "theta": theta, "disc": disc}
    weighted = {**stage, "discount": discount, "costate": costate}
    return [
        _function("transition", {"x": x, "u": u}, {"next_x": next_x}),
        _function("stage_cost", stage, {"cost": cost}),
        _function("terminal_cost", last, {"cost": terminal}),
        _function("constraint", obstacle, {"h": constraint}),
        _function("expand_stage", weighted, expand),
        _function(
            "expand_terminal", {**last, "discount": discount}, {"lx": lx, "Q": terminal_hessian}
        ),
        _function("expand_constraint", obstacle, {"hx": hx, "hxx": constraint_hessian}),
        _function("stage_gradient", stage, {"gradient": stage_gradient}),
        _function("terminal_gradient", last, {"gradient": terminal_gradient}),
        _function("constraint_gradient", obstacle, {"gradient": constraint_gradient}),
        _function(
            "stage_mixed_hessian",
            {**stage, "w": w},
            {
                "lx": along(ca.gradient(cost, x), (theta, w)),
                "lu": along(ca.gradient(cost, u), (theta, w)),
            },
        ),
        _function(
            "terminal_mixed_hessian",
            {**last, "w": w},
            {"lx": along(ca.gradient(terminal, x), (theta, w))},
        ),
        _function("constraint_mixed_hessian", {**obstacle, "w": w}, {"hx": along(hx, (theta, w))}),
        _function(
            "stage_gradient_along",
            {**stage, "dx": dx, "du": du, "w": w},
            {"gradient": along(stage_gradient, (x, dx), (u, du), (theta, w))},
        ),
        _function(
            "terminal_gradient_along",
            {**last, "dx": dx, "w": w},
            {"gradient": along(terminal_gradient, (x, dx), (theta, w))},
        ),
        _function(
            "constraint_gradient_along",
            {**obstacle, "dx": dx, "w": w},
            {"gradient": along(constraint_gradient, (x, dx), (theta, w))},
        ),
    ]


def _function(name: str, of: dict[str, ca.SX], results: dict[str, ca.SX]) -> ca.Function:
    return ca.Function(name, [*of.values()], [*results.values()], [*of], [*results])
