"""What `rows` and `slopes` need to know of a `Problem`, a stage at a time.

These are the signatures: `problem_stages.write` generates a module of the same name, as `stages`
does for `model`. The Lagrangian of a stage is discount cost + costate' transition + lam' rows.
Names that end in an underscore are results, written in place.
"""

from typing import Any

NROWS = 0  # h <= sigma of a stage


def transition(x: Any, u: Any, theta: Any, d: Any, next_x_: Any) -> None:
    """f."""
    raise NotImplementedError


def stage_cost(x: Any, u: Any, theta: Any, d: Any) -> float:
    """l."""
    raise NotImplementedError


def terminal_cost(x: Any, theta: Any, d: Any) -> float:
    """V_f."""
    raise NotImplementedError


def steepest(x: Any, u: Any, theta: Any, d: Any) -> float:
    """The largest slope of l in x and u, or of V_f in x."""
    raise NotImplementedError


def initial_cost(x: Any, theta: Any, d: Any) -> float:
    """V0."""
    raise NotImplementedError


def path_rows(x: Any, u: Any, theta: Any, d: Any, h_: Any) -> None:
    """h."""
    raise NotImplementedError


def row_sizes(x: Any, u: Any, theta: Any, d: Any, size_: Any) -> None:
    """The size of each row, see `Problem.row_sizes`."""
    raise NotImplementedError


def last_rows(x: Any, theta: Any, d: Any, h_: Any) -> None:
    """h at stage N, where there is no u; 0 for rows that depend on it."""
    raise NotImplementedError


def expand_stage(
    x: Any,
    u: Any,
    theta: Any,
    d: Any,
    discount: Any,
    costate: Any,
    lam: Any,
    A_: Any,
    B_: Any,
    lx_: Any,
    lu_: Any,
    Q_: Any,
    S_: Any,
    R_: Any,
    hx_: Any,
    hu_: Any,
) -> None:
    """Jacobians of f and h; gradient of discount l; Hessian of the stage's Lagrangian."""
    raise NotImplementedError


def expand_last(
    x: Any, theta: Any, d: Any, discount: Any, lam: Any, lx_: Any, Q_: Any, hx_: Any
) -> None:
    """The same of discount V_f + lam' h."""
    raise NotImplementedError


def stage_gradient(
    x: Any, u: Any, theta: Any, d: Any, discount: Any, costate: Any, lam: Any, gradient_: Any
) -> None:
    """Gradient of the stage's Lagrangian in theta."""
    raise NotImplementedError


def last_gradient(x: Any, theta: Any, d: Any, discount: Any, lam: Any, gradient_: Any) -> None:
    """Gradient of discount V_f + lam' h in theta."""
    raise NotImplementedError


def initial_gradient(x: Any, theta: Any, d: Any, gradient_: Any) -> None:
    """Gradient of V0 in theta."""
    raise NotImplementedError


def stage_mixed(
    x: Any,
    u: Any,
    theta: Any,
    d: Any,
    discount: Any,
    costate: Any,
    lam: Any,
    w: Any,
    lx_: Any,
    lu_: Any,
    f_: Any,
    h_: Any,
) -> None:
    """How theta along w moves the Lagrangian's gradients in x and u, f, and h."""
    raise NotImplementedError


def last_mixed(
    x: Any, theta: Any, d: Any, discount: Any, lam: Any, w: Any, lx_: Any, h_: Any
) -> None:
    """The same of stage N."""
    raise NotImplementedError


def stage_along(
    x: Any,
    u: Any,
    theta: Any,
    d: Any,
    discount: Any,
    costate: Any,
    lam: Any,
    dx: Any,
    du: Any,
    dcostate: Any,
    dlam: Any,
    w: Any,
    gradient_: Any,
) -> None:
    """How `stage_gradient` changes along all these directions."""
    raise NotImplementedError


def last_along(
    x: Any,
    theta: Any,
    d: Any,
    discount: Any,
    lam: Any,
    dx: Any,
    dlam: Any,
    w: Any,
    gradient_: Any,
) -> None:
    """How `last_gradient` changes."""
    raise NotImplementedError


def initial_along(x: Any, theta: Any, d: Any, w: Any, gradient_: Any) -> None:
    """How `initial_gradient` changes along w."""
    raise NotImplementedError
