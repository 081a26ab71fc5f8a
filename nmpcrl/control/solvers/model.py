"""What `kernel` asks of a `Problem`, a stage at a time: names of functions and their arguments.

`stages.write` generates a module of the same name, and the solver is compiled beside that one, so
that nothing here ever runs. Names that end in an underscore are results, written in place; an
argument that comes back as one is added to. A stage's Lagrangian is discount l + costate' f + lam'
h. Of `fixed` rows and those of a `line` of data there are the same functions, each also for stage N
(`_end`), where rows that depend on u are 0; the arguments of a line follow d.
"""

from typing import Any

NX = NU = NTHETA = 0
SOFT, FIXED = 0, 0  # rows that belong to no line: soft ones, and with hard ones behind them
PER, WIDTH = 0, 0  # rows of a line of data, and numbers in it
OWN = 0  # data of a stage that belong to no line


def _generated(*_: Any) -> Any:
    raise NotImplementedError


transition = _generated  # x, u, theta, d, f_
stage_cost = terminal_cost = initial_cost = _generated  # x, (u,) theta, d -> l, V_f or V0
stage_size = terminal_size = _generated  # x, (u,) theta, d -> the size of l or V_f
expand_stage = _generated  # x, u, theta, d, discount, costate, A_, B_, lx_, lu_, Q_, S_, R_
expand_terminal = _generated  # x, theta, d, discount, lx_, Q_
stage_theta = _generated  # x, u, theta, d, discount, costate, gradient_: in theta
terminal_theta = initial_theta = _generated  # x, theta, d, (discount,) gradient_
stage_mixed = _generated  # x, u, theta, d, discount, costate, w, lx_, lu_, f_: along w in theta
terminal_mixed = _generated  # x, theta, d, discount, w, lx_
stage_along = _generated  # x, u, theta, d, discount, costate, dx, du, dcostate, w, gradient_
terminal_along = initial_along = _generated  # x, theta, d, (discount, dx,) w, gradient_

fixed_sizes = line_sizes = _generated  # x, u, theta, d, size_
fixed_rows = fixed_end_rows = line_rows = line_end_rows = _generated  # x, u, theta, d, h_
expand_fixed = expand_fixed_end = expand_line = expand_line_end = _generated  # x, u, theta, d, lam,
#   px, pu, Q, S, R, hx_, hu_, px_, pu_, Q_, S_, R_
condense_fixed = condense_fixed_end = condense_line = condense_line_end = _generated  # stiff, pull,
#   hx, hu, q, r, Q, S, R, q_, r_, Q_, S_, R_
along_fixed = along_fixed_end = along_line = along_line_end = _generated  # hx, hu, dx, du, h_
theta_fixed = theta_fixed_end = theta_line = theta_line_end = _generated  # x, u, theta, d, lam,
#   gradient, gradient_
mixed_fixed = mixed_fixed_end = mixed_line = mixed_line_end = _generated  # x, u, theta, d, lam, w,
#   lx, lu, h_, lx_, lu_
along_theta_fixed = along_theta_fixed_end = _generated  # x, u, theta, d, lam, dx, du, dlam, w,
along_theta_line = along_theta_line_end = _generated  # gradient, gradient_
