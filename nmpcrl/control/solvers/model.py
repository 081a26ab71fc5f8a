"""What `kernel` asks of a `Problem`, a stage at a time: names of functions and their arguments.

`stages.write` generates a module of the same name, and the solver is compiled beside that one, so
that nothing here ever runs. Names that end in an underscore are results: px, pu, q, r, Q, S, R and
gradient are added to what the array holds, the others written. A stage's Lagrangian is discount l +
costate' f + lam' h. Arrays of rows hold those of all stages; `at` says where those of the stage
begin. A row that depends on u is absent at stage N, and the u that is given there counts nothing.
"""

from typing import Any

NX = NU = NTHETA = 0
SOFT, FIXED = 0, 0  # rows that belong to no line: soft ones, and with hard ones behind them
PER, WIDTH = 0, 0  # rows of a line of data, and numbers in it
OWN = 0  # data of a stage that belong to no line


def _generated(*_: Any) -> Any:
    raise NotImplementedError


transition = _generated  # x, u, theta, d, next_x_
stage_cost = terminal_cost = initial_cost = _generated  # x, (u,) theta, d -> l, V_f or V0
stage_size = terminal_size = _generated  # x, (u,) theta, d -> the size of l or V_f
expand_stage = _generated  # x, u, theta, d, discount, costate, A_, B_, lx_, lu_, Q_, S_, R_
expand_terminal = _generated  # x, theta, d, discount, lx_, Q_
stage_theta = _generated  # x, u, theta, d, discount, costate, gradient_: in theta
terminal_theta = initial_theta = _generated  # x, theta, d, (discount,) gradient_
stage_mixed = _generated  # x, u, theta, d, discount, costate, w, q_, r_, f_: along w in theta
terminal_mixed = _generated  # x, theta, d, discount, w, q_
stage_along = _generated  # x, u, theta, d, discount, costate, dx, du, dcostate, w, gradient_
terminal_along = initial_along = _generated  # x, theta, d, (discount, dx,) w, gradient_

# Of all rows of a stage. The generated module has a function of `fixed` rows and one of a `line`
# beside each, as `measure_fixed` and `measure_line`.
size_rows = _generated  # x, u, theta, d, size_, at, lines
measure_rows = _generated  # x, u, theta, d, h_, at, lines
expand_rows = _generated  # x, u, theta, d, lam, hx_, hu_, px_, pu_, Q_, S_, R_, at, lines
condense_rows = _generated  # stiff, pull, hx, hu, q_, r_, Q_, S_, R_, at, lines
along_rows = _generated  # hx, hu, dx, du, h_, at, lines
theta_rows = _generated  # x, u, theta, d, lam, gradient_, at, lines
mixed_rows = _generated  # x, u, theta, d, lam, w, q_, r_, h_, at, lines
along_theta_rows = _generated  # x, u, theta, d, lam, dx, du, dlam, w, gradient_, at, lines
