"""The update rules, one equation a function. Here delta, phi and w are the paper's symbols."""

from nmpcrl import Vector


def td_error(cost: float, gamma: float, q: float, q_next: float) -> float:
    """TD error: Eq. (7), or Eq. (11) when a network supplies `q_next`."""
    return cost + gamma * q_next - q


def semi_gradient_step(theta: Vector, delta: float, phi: Vector, alpha: float) -> Vector:
    """theta of Expected Sarsa, Eq. (9); phi is the gradient of Q_theta(s, a), shape (d,)."""
    return theta + alpha * delta * phi


def gradient_td_step(
    theta: Vector,
    w: Vector,
    delta: float,
    phi: Vector,
    phi_next: Vector,
    *,
    alpha: float,
    gamma: float,
) -> Vector:
    """theta of GES, the first line of Eq. (16); all vectors of shape (d,).

    As printed: without the curvature term of nonlinear TDC (Maei et al. 2009).  # departure K
    """
    return theta + alpha * (delta * phi - gamma * (w @ phi) * phi_next)


def auxiliary_step(w: Vector, delta: float, phi: Vector, beta: float) -> Vector:
    """w of GES, the second line of Eq. (16): least mean squares of delta on phi, shape (d,)."""
    return w + beta * (delta - phi @ w) * phi
