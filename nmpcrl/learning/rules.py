"""The update rules for hosts other than Python: the functions of `updates`, on pointers.

`browser` compiles this file beside `loop` and `updates`. A vector is a pointer to its d numbers; `out`
may be one of the arguments.
"""

from numba import carray, float64, int32, njit, types

from .loop import (
    _auxiliary_step,
    _curvature_correction,
    _gradient_td_step,
    _project,
    _semi_gradient_step,
    _td_error,
    plain,
)

address = types.CPointer(float64)


@plain
def write(d, vector, out):
    """Put a vector where the host finds it."""
    there = carray(out, d)
    for k in range(d):
        there[k] = vector[k]
    return 0


@njit(float64(float64, float64, float64, float64), error_model="numpy")
def rule_td_error(cost, gamma, q, q_next):
    """Eq. (7)."""
    return _td_error(cost, gamma, q, q_next)


@njit(int32(int32, address, float64, address, float64, address), error_model="numpy")
def rule_semi_gradient(d, theta, delta, phi, alpha, out):
    """Eq. (9)."""
    return write(d, _semi_gradient_step(carray(theta, d), delta, carray(phi, d), alpha), out)


@njit(
    int32(int32, address, address, float64, address, address, float64, float64, address),
    error_model="numpy",
)
def rule_gradient_td(d, theta, w, delta, phi, phi_next, alpha, gamma, out):
    """The first line of Eq. (16)."""
    moved = _gradient_td_step(
        carray(theta, d), carray(w, d), delta, carray(phi, d), carray(phi_next, d),
        alpha, gamma,
    )  # fmt: skip
    return write(d, moved, out)


@njit(int32(int32, address, float64, address, float64, address), error_model="numpy")
def rule_auxiliary(d, w, delta, phi, beta, out):
    """The second line of Eq. (16)."""
    return write(d, _auxiliary_step(carray(w, d), delta, carray(phi, d), beta), out)


@njit(int32(int32, float64, address, address, address, address), error_model="numpy")
def rule_curvature(d, delta, phi, w, hessian_w, out):
    """h of nonlinear TDC."""
    h = _curvature_correction(delta, carray(phi, d), carray(w, d), carray(hessian_w, d))
    return write(d, h, out)


@njit(int32(int32, address, float64, float64, address), error_model="numpy")
def rule_project(d, theta, least, most, out):
    """The nearest theta within the bounds."""
    return write(d, _project(carray(theta, d), least, most), out)


EXPORTS = (
    rule_td_error, rule_semi_gradient, rule_gradient_td, rule_auxiliary, rule_curvature,
    rule_project,
)  # fmt: skip
