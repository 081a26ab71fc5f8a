"""What the solver in `kernel` needs to know of a plant, a stage at a time.

These are the signatures. `stages.write` generates a module of the same name from CasADi's
expressions, and the solver is compiled beside that one, so none of the bodies below ever runs.
Names that end in an underscore are results, written in place.
"""

from typing import Any

NX = 0  # states
NU = 0  # inputs
NTHETA = 0  # parameters


def transition(x: Any, u: Any, next_x_: Any) -> None:
    """The plant, Eq. (18)."""
    raise NotImplementedError


def stage_cost(x: Any, u: Any, theta: Any, target: Any) -> float:
    """L(x, u, theta) of Eq. (2a)."""
    raise NotImplementedError


def terminal_cost(x: Any, theta: Any, target: Any) -> float:
    """Gamma(x, theta) of Eq. (2a)."""
    raise NotImplementedError


def constraint(x: Any, theta: Any, disc: Any) -> float:
    """Xi + theta_c of Eq. (2f) for one obstacle, (centre x, centre y, clearance)."""
    raise NotImplementedError


def expand_stage(
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
    """Jacobians of `transition`; gradient of discount `stage_cost`; Hessian of the Lagrangian.

    That is discount `stage_cost` + costate' `transition`.
    """
    raise NotImplementedError


def expand_terminal(x: Any, theta: Any, target: Any, discount: Any, lx_: Any, Q_: Any) -> None:
    """Gradient and Hessian of discount `terminal_cost`."""
    raise NotImplementedError


def expand_constraint(x: Any, theta: Any, disc: Any, hx_: Any, hxx_: Any) -> None:
    """Gradient and Hessian of `constraint`."""
    raise NotImplementedError


def stage_gradient(x: Any, u: Any, theta: Any, target: Any, gradient_: Any) -> None:
    """Gradient of `stage_cost` in theta."""
    raise NotImplementedError


def terminal_gradient(x: Any, theta: Any, target: Any, gradient_: Any) -> None:
    """Gradient of `terminal_cost` in theta."""
    raise NotImplementedError


def constraint_gradient(x: Any, theta: Any, disc: Any, gradient_: Any) -> None:
    """Gradient of `constraint` in theta."""
    raise NotImplementedError


def stage_mixed_hessian(
    x: Any, u: Any, theta: Any, target: Any, w: Any, lx_: Any, lu_: Any
) -> None:
    """The mixed second derivative of `stage_cost` in (x, u) and theta, times w."""
    raise NotImplementedError


def terminal_mixed_hessian(x: Any, theta: Any, target: Any, w: Any, lx_: Any) -> None:
    """The mixed second derivative of `terminal_cost` in x and theta, times w."""
    raise NotImplementedError


def constraint_mixed_hessian(x: Any, theta: Any, disc: Any, w: Any, hx_: Any) -> None:
    """The mixed second derivative of `constraint` in x and theta, times w."""
    raise NotImplementedError


def stage_gradient_along(
    x: Any, u: Any, theta: Any, target: Any, dx: Any, du: Any, w: Any, gradient_: Any
) -> None:
    """How `stage_gradient` changes while x, u and theta move along dx, du and w."""
    raise NotImplementedError


def terminal_gradient_along(
    x: Any, theta: Any, target: Any, dx: Any, w: Any, gradient_: Any
) -> None:
    """How `terminal_gradient` changes while x and theta move along dx and w."""
    raise NotImplementedError


def constraint_gradient_along(
    x: Any, theta: Any, disc: Any, dx: Any, w: Any, gradient_: Any
) -> None:
    """How `constraint_gradient` changes while x and theta move along dx and w."""
    raise NotImplementedError
