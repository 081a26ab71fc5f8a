"""The update rules, one equation a function. Here delta, phi and w are the paper's symbols."""

import numpy as np

from nmpcrl import Vector

# A semi-gradient step multiplies the TD error of its own transition by 1 - alpha ||phi||^2, to
# first order and with the target held. Where alpha ||phi||^2 is above 2, it changes sign and grows.
OVERSHOOT = 2.0


def dot(x: Vector, y: Vector) -> float:
    """x'y, summed from the first number to the last: `x @ y` has other last bits on other hosts."""
    result: float = np.cumsum(x * y)[-1]
    return result


def td_error(cost: float, gamma: float, q: float, q_next: float) -> float:
    """TD error: Eq. (7), or Eq. (11) when a network supplies `q_next`."""
    return cost + gamma * q_next - q


def semi_gradient_step(theta: Vector, delta: float, phi: Vector, alpha: float) -> Vector:
    """theta of Expected Sarsa, Eq. (9); phi is the gradient of Q_theta(s, a), shape (d,)."""
    return theta + alpha * delta * phi


def gradient_td_step(
    theta: Vector, w: Vector, delta: float, phi: Vector, phi_next: Vector, alpha: float,
    gamma: float,
) -> Vector:  # fmt: skip
    """theta of GES, the first line of Eq. (16); all vectors of shape (d,).

    As printed: without the curvature term of nonlinear TDC (Maei et al. 2009).  # departure K
    """
    return theta + alpha * (delta * phi - gamma * dot(w, phi) * phi_next)


def auxiliary_step(w: Vector, delta: float, phi: Vector, beta: float) -> Vector:
    """w of GES, the second line of Eq. (16): least mean squares of delta on phi, shape (d,)."""
    return w + beta * (delta - dot(phi, w)) * phi


def curvature_correction(delta: float, phi: Vector, w: Vector, hessian_w: Vector) -> Vector:
    """h of nonlinear TDC (Maei et al. 2009), which Eq. (16) drops, shape (d,).  # departure K

    `hessian_w` is the Hessian of Q_theta(s, a) in theta times w, shape (d,).
    """
    return (delta - dot(phi, w)) * hessian_w


def project(theta: Vector, least: float | Vector, most: float | Vector) -> Vector:
    """The nearest theta with every component in [least, most]: the compact set of Maei et al."""
    return np.minimum(np.maximum(theta, least), most)


def of_length(direction: Vector, length: float) -> Vector:
    """A step along `direction` of Euclidean norm `length`; none where there is no direction."""
    norm = np.linalg.norm(direction)
    return direction * (length / norm) if norm > 0 else np.zeros_like(direction)
