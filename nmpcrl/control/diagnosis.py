"""Why a solve may have failed: numbers that are not finite, a fast model, a kink."""

import casadi as ca
import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.expression import place
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.solution import short

FASTEST = 10.0  # factor of a small deviation in one step
FARTHEST = 1e9  # largest number in a state of a plan
UNSTABLE = "an unstable model takes a shorter horizon"
SUBSTEPS = f"dynamics too fast for their period take more substeps, of rk4 or the plant; {UNSTABLE}"
ORDERS = {  # what is not finite -> what to write instead
    "": "keep it finite, as ca.log(ca.fmax(x, 1e-6)) does",
    "the derivative of ": "write ca.sqrt(ca.sumsqr(x) + 1e-9) for ca.norm_2(x), and so on",
    "the second derivative of ": "write a power of 2 or more, or add a small number to its base",
}
KINKS = {
    getattr(ca, f"OP_{name.upper()}"): name
    for name in ("fabs", "fmin", "fmax", "sign", "floor", "ceil", "fmod", "copysign")
} | {ca.OP_IF_ELSE_ZERO: "if_else"}
ROUND = (
    "where plans come to rest on one, no solver descends: write w |h| of a cost as rows,"
    " Soft(lambda x, u, th: ca.vertcat(h, -h), weight=w), and w max(0, h) as one, or round it,"
    " ca.sqrt(h**2 + 1e-4) for ca.fabs(h)"
)


class Diagnosis:
    """The functions of an OCP and their derivatives along a rollout at rest."""

    def __init__(self, ocp: Ocp) -> None:
        of, e = ocp.problem, ocp.problem.expressions
        self._problem, z, data = of, ca.vertcat(e.x, e.u), ca.SX.sym("d", of.data_names.size)
        given = [e.x, e.u, e.theta, data]
        costs = [e.next_x, e.stage, e.terminal, e.initial]
        model, stage, terminal, initial = ca.substitute(costs, [e.d], [data[: of.own_names.size]])
        rows = of.rows(*given)
        parts = {"model": model, "stage": stage, "rows": rows, "initial": initial}
        sharp = {"model": model, "stage": stage, "terminal": terminal, "rows": rows}
        self._kinks = {name: kinks_in(written, z) for name, written in sharp.items()}
        self._functions: dict[str, ca.Function] = {}
        for name, written in parts.items():
            slope = ca.jacobian(written, z)
            bend = ca.reshape(ca.jacobian(ca.vec(slope), z), written.numel(), z.numel() ** 2)
            orders = [ca.densify(one) for one in (written, slope, bend)]
            self._functions[name] = ca.Function(name, given, orders)

    def why(self, state: Vector, theta: Vector, data: Matrix) -> str:
        """The first fault of a rollout at rest, or a kink, in one sentence; "" if there is none."""
        for i in range(self._problem.horizon):
            at = state, self._problem.still
            values = {
                name: [order.full() for order in function(*at, theta, data[i])]
                for name, function in self._functions.items()
            }
            said = self._not_finite(values) or self._too_fast(i + 1, *values["model"])
            if said:
                return said.format("at x = {}, u = {}".format(*map(short, at)))
            state = values["model"][0].ravel()
        for name, kinks in self._kinks.items():
            if kinks:
                return f"{name} has a kink ({', '.join(kinks)}); {ROUND}"
        return ""

    def _not_finite(self, values: dict[str, list[Matrix]]) -> str:
        """The function or derivative that is not finite, with {} for the point."""
        for order, (of, advice) in enumerate(ORDERS.items()):
            for name, orders in values.items():
                found = orders[order]
                for row, column in np.argwhere(~np.isfinite(found)):
                    called = of + place(name, int(row), len(found))
                    return f"{called} is {found[row, column]} {{}}: {advice}"
        return ""

    def _too_fast(self, steps: int, value: Matrix, slope: Matrix, _: Matrix) -> str:
        """How fast the model is, or how far it leads."""
        growth = np.abs(np.linalg.eigvals(slope[:, : self._problem.states])).max()
        largest = np.abs(value).max()
        if growth > FASTEST:
            does = f"makes {growth:.1g} times as much of a small deviation in one step"
            return f"model {does}, {{}}: {SUBSTEPS}"
        if largest > FARTHEST:
            return f"model leads to {largest:.1g} in {steps} steps at rest: {UNSTABLE}"
        return ""


def kinks_in(written: ca.SX, moved: ca.SX) -> list[str]:
    """The names of operations with a kink whose arguments depend on `moved`."""
    others = [one for one in ca.symvar(written) if not ca.depends_on(moved, one)]
    function = ca.Function("written", [moved, ca.vertcat(*others)], [written])
    moving: set[int] = set()  # places that the plan moves, each written to several times
    found = set()
    for k in range(function.n_instructions()):
        operation, of = function.instruction_id(k), function.instruction_input(k)
        moves = of[0] == 0 if operation == ca.OP_INPUT else bool(moving & {*of})
        if moves and operation in KINKS:
            found.add(KINKS[operation])
        into = set(function.instruction_output(k)[:1])
        moving = moving | into if moves else moving - into
    return sorted(found)
