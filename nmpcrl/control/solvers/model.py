"""What the solver in `kernel` needs to know of a plant, a stage at a time.

These are the signatures. `stages.write` generates a module of the same name from CasADi's
expressions, and the solver is compiled beside that one, so none of the bodies below ever runs.
Names that end in an underscore are results, written in place.
"""

from typing import Any

NX = 0  # states
NU = 0  # inputs
NTHETA = 0  # parameters


def step(x: Any, u: Any, next_x_: Any) -> None:
    """The plant, Eq. (18)."""
    raise NotImplementedError


def cost(x: Any, u: Any, theta: Any, target: Any) -> float:
    """L(x, u, theta) of Eq. (2a)."""
    raise NotImplementedError


def end(x: Any, theta: Any, target: Any) -> float:
    """Gamma(x, theta) of Eq. (2a)."""
    raise NotImplementedError


def path(x: Any, theta: Any, disc: Any) -> float:
    """Xi + theta_c of Eq. (2f) for one obstacle, (centre x, centre y, clearance)."""
    raise NotImplementedError


def expand(
    x: Any,
    u: Any,
    theta: Any,
    target: Any,
    discount: Any,
    costate: Any,
    A_: Any,
    B_: Any,
    lx_: Any,
    lu_: Any,
    Q_: Any,
    S_: Any,
    R_: Any,
) -> None:
    """Jacobians of `step`, gradient of discount `cost`, Hessian of that plus costate' `step`."""
    raise NotImplementedError


def expand_end(x: Any, theta: Any, target: Any, discount: Any, lx_: Any, Q_: Any) -> None:
    """Gradient and Hessian of discount `end`."""
    raise NotImplementedError


def expand_path(x: Any, theta: Any, disc: Any, hx_: Any, hxx_: Any) -> None:
    """Gradient and Hessian of `path`."""
    raise NotImplementedError


def cost_slope(x: Any, u: Any, theta: Any, target: Any, slope_: Any) -> None:
    """Gradient of `cost` in theta."""
    raise NotImplementedError


def end_slope(x: Any, theta: Any, target: Any, slope_: Any) -> None:
    """Gradient of `end` in theta."""
    raise NotImplementedError


def path_slope(x: Any, theta: Any, disc: Any, slope_: Any) -> None:
    """Gradient of `path` in theta."""
    raise NotImplementedError


def turn(x: Any, u: Any, theta: Any, target: Any, w: Any, lx_: Any, lu_: Any) -> None:
    """How the gradient of `cost` in x and u changes while theta moves along w."""
    raise NotImplementedError


def turn_end(x: Any, theta: Any, target: Any, w: Any, lx_: Any) -> None:
    """How the gradient of `end` in x changes while theta moves along w."""
    raise NotImplementedError


def turn_path(x: Any, theta: Any, disc: Any, w: Any, hx_: Any) -> None:
    """How the gradient of `path` in x changes while theta moves along w."""
    raise NotImplementedError


def bend(x: Any, u: Any, theta: Any, target: Any, dx: Any, du: Any, w: Any, slope_: Any) -> None:
    """How `cost_slope` changes while x, u and theta move along dx, du and w."""
    raise NotImplementedError


def bend_end(x: Any, theta: Any, target: Any, dx: Any, w: Any, slope_: Any) -> None:
    """How `end_slope` changes while x and theta move along dx and w."""
    raise NotImplementedError


def bend_path(x: Any, theta: Any, disc: Any, dx: Any, w: Any, slope_: Any) -> None:
    """How `path_slope` changes while x and theta move along dx and w."""
    raise NotImplementedError
