"""Optimal control in which any symbol can be learned: `Problem`, given to `Nmpc`.

    min   V0(s, theta) + sum_i gamma^i l(x_i, u_i, theta, d_i) + gamma^N V_f(x_N, theta, d_N)
          + sum_i gamma^i W' sigma_i
    s.t.  x_0 = s,  x_{i+1} = f(x_i, u_i, theta, d_i),  lower <= u_i <= upper,
          h(x_i, u_i, theta, d_i) <= sigma_i,  sigma_i >= 0

f, l, V_f, V0 and h are written once, in CasADi's SX; all their derivatives follow from that.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control.blocks import Blocks, Symbols, numbers
from nmpcrl.control.description import Described
from nmpcrl.control.expression import expression
from nmpcrl.control.vectors import kept, whole

SMALL, LARGE = 1e-2, 1e4  # sizes of states that every solver takes as they are
LEAST = 1e-200  # curvature, or slope


@dataclass(frozen=True, eq=False)
class Parameter:
    """Numbers that are learned: where they start and, for learners that project, their bounds.

    A weight of a cost, which must not turn negative, is Parameter(start, lower=0).
    """

    start: Any  # a number or an array
    lower: Any = -np.inf  # a number, or one for each
    upper: Any = np.inf


@dataclass(frozen=True, eq=False)
class Soft:
    """Rows h <= sigma, sigma >= 0, whose slacks cost `weight` each, discounted."""

    row: Callable[..., Any]  # (x, u, th) -> h, a number or a column; with d where there are data
    weight: Any = 1.0  # W > 0, a number, or one a row
    stages: Any = None  # among 0, ..., N: an index, a slice or a list; all possible ones if None


@dataclass(frozen=True, eq=False)
class Series:
    """Data of every stage, taken where `Nmpc.solve` is given none."""

    values: Any  # an array with an axis of N + 1 in front


class Expressions(NamedTuple):
    """A problem in symbols."""

    x: ca.SX
    u: ca.SX
    theta: ca.SX
    d: ca.SX  # of one stage
    next_x: ca.SX
    stage: ca.SX
    terminal: ca.SX
    initial: ca.SX
    rows: ca.SX  # h, shape (M,)


class Problem(Described):
    """What an NMPC minimises, in symbols of which each may be learned.

    It can be pickled and copied, whatever its functions are: as expressions they go along.
    """

    def __init__(
        self,
        *,
        states: int,
        inputs: int,
        horizon: int,
        theta: Mapping[str, Any],
        model: Callable[..., Any],
        stage: Callable[..., Any],
        terminal: Callable[..., Any] | None = None,
        initial: Callable[..., Any] | None = None,
        soft: Soft | Sequence[Soft] = (),
        lower: Any = -np.inf,
        upper: Any = np.inf,
        gamma: float = 1.0,
        data: Mapping[str, Any] | None = None,
        scale: Any = None,
    ) -> None:
        """Write the problem down in symbols and look through it.

        The functions take SX and return SX: `x` and `u` are columns, `th["A"]` is the parameter of
        that name in its shape. Where there are data, `d["price"]` is that of the stage, and `d` is
        the last argument of all of them.

        Args:
            states: n.
            inputs: m.
            horizon: N, the number of planned inputs.
            theta: what is learned: by name, an array to start from, or a `Parameter`.
            model: (x, u, th) -> x+, a discrete-time map; `rk4` makes one of a derivative.
            stage: (x, u, th) -> l.
            terminal: (x, th) -> V_f, 0 if absent.
            initial: (x, th) -> V0 of the state in which the plan begins, 0 if absent.
            soft: rows that may be violated at a price, a `Soft` or several. A kink in a cost is
                written as rows: w |h| is Soft(lambda x, u, th: ca.vertcat(h, -h), weight=w).
            lower: least input, a number or one an input.
            upper: largest input.
            gamma: discount factor, 0 < gamma <= 1.
            data: what is known of every stage and not learned: by name, the array of one stage, or
                a `Series` of all, that is taken where `Nmpc.solve` is given none.
            scale: typical sizes of the states, a number or one a state: it is solved in these
                units. Absent, they are 1, or what the costs say where that is below 0.01 or
                above 10,000.

        Raises:
            ValueError: something is no such thing; the message names it and says what to write.
        """
        self.states, self.inputs, self.horizon = (
            whole(name, number)
            for name, number in (("states", states), ("inputs", inputs), ("horizon", horizon))
        )
        self.gamma = discount(gamma)
        self.lower, self.upper = _bounds(lower, upper, self.inputs)
        parameters = {
            name: one if isinstance(one, Parameter) else Parameter(one)
            for name, one in theta.items()
        }
        starts = {name: numbers(f"theta {name}", one.start) for name, one in parameters.items()}
        self.names = Blocks("theta", {name: start.shape for name, start in starts.items()})
        if not self.names.size:
            raise ValueError("theta is empty: name at least one parameter, or nothing is learned")
        self.theta = kept(self.names.filled(np.zeros(self.names.size), starts))
        self.theta_lower, self.theta_upper = (
            kept(np.concatenate([_spread(name, getattr(parameters[name], side), starts[name])
                                 for name in parameters]))
            for side in ("lower", "upper")
        )  # fmt: skip
        self._refuse_outside()
        defaults = {
            name: numbers(f"data {name}", one.values if isinstance(one, Series) else one)
            for name, one in (data or {}).items()
        }
        shapes = {
            name: one.shape[isinstance((data or {})[name], Series) :]
            for name, one in defaults.items()
        }
        self.data_names = Blocks("data", shapes)
        empty: Matrix = np.zeros((self.horizon + 1, self.data_names.size))
        self.data = kept(self.data_names.filled(empty, defaults))
        soft = _rows(soft)
        self._function, sizes = self._written(model, stage, terminal, initial, soft)
        self.weights = kept(_weights(soft, sizes))
        self.on_inputs = _depends(self.expressions.rows, self.expressions.u)
        self.active = self._active(soft, sizes)
        self.sizes = _sizes(scale, self)

    @cached_property
    def expressions(self) -> Expressions:
        """The problem in symbols."""
        arguments = self._function.sx_in()
        return Expressions(*arguments, *self._function.call(arguments))

    def _described(self) -> tuple[Any, ...]:
        return (
            "problem", self._function, self.horizon, self.gamma, self.lower, self.upper,
            self.names, self.theta, self.theta_lower, self.theta_upper,
            self.weights, self.active, self.data_names, self.data, self.sizes,
        )  # fmt: skip

    @cached_property
    def cost_scale(self) -> float:
        """What riccati divides the objective by, half of the largest curvature or a slope."""
        curvature, slope = _bends(self, self.gamma**self.horizon)
        found = max(np.abs(curvature).max() / 2, np.abs(slope).max())
        return float(found) if 0 < found < np.inf else 1.0

    @cached_property
    def row_sizes(self) -> ca.SX:
        """The size of each row, its slope along `sizes`, or 1 between `SMALL` and `LARGE`."""
        e = self.expressions
        slopes = ca.jacobian(e.rows, ca.vertcat(e.x, e.u))
        found = ca.densify(ca.mtimes(ca.fabs(slopes), ca.DM(np.concatenate(self.sizes))))
        usual = ca.logic_and(found > SMALL, found < LARGE)
        unknown = ca.logic_not(found < 1 / LEAST)  # or nan
        return ca.if_else(ca.logic_or(usual, unknown), 1, found + LEAST)

    @cached_property
    def typical_row_sizes(self) -> Vector:
        """The largest of `row_sizes` among states of the sizes -1, 0 and 1, or 1, shape (M,).

        A row that nothing moves there, as where its data are zeros, has no size to be read.
        """
        e, still = self.expressions, np.clip(np.zeros(self.inputs), self.lower, self.upper)
        sizes = ca.Function("sizes", [e.x, e.u, e.theta, e.d], [self.row_sizes])
        at = [sizes(k * self.sizes[0], still, self.theta, self.data[0]) for k in (-1, 0, 1)]
        found: Vector = np.max([one.full().ravel() for one in at], axis=0, initial=0.0)
        return np.where(found > LEAST, found, 1.0)

    @cached_property
    def solved(self) -> "Problem":
        """The same problem with states and inputs in parts of `sizes`, which is what is solved."""
        if all((size == 1).all() for size in self.sizes):
            return self
        (states, inputs), other = self.sizes, copy(self)
        x, u, theta, d = given = self._function.sx_in()
        next_x, *costs = self._function(ca.DM(states) * x, ca.DM(inputs) * u, theta, d)
        function = ca.Function("problem", given, [next_x / ca.DM(states), *costs])
        bounds = {"lower": kept(self.lower / inputs), "upper": kept(self.upper / inputs)}
        vars(other).update(_function=function, sizes=_ones(self), **bounds)
        return other

    def split(self, theta: Vector) -> dict[str, Any]:
        """A vector in the order of theta, or of its gradient, by name."""
        return self.names.split(np.asarray(theta, float))

    def vector(self, **values: Any) -> Vector:
        """theta with these parameters, and the others as they start."""
        return self.names.filled(self.theta, values)

    def stage_data(self, values: Mapping[str, Any] | None) -> Matrix:
        """d_0, ..., d_N, shape (N + 1, size): those given, the others as in the problem.

        Raises:
            ValueError: a name is unknown, or a shape neither that of a stage nor of all.
        """
        return self._known if values is None else self.data_names.filled(self.data, values)

    @cached_property
    def _known(self) -> Matrix:
        """The data as machine code takes them, which could be written to and are not."""
        return self.data.copy()

    def _written(
        self,
        model: Callable[..., Any],
        stage: Callable[..., Any],
        terminal: Callable[..., Any] | None,
        initial: Callable[..., Any] | None,
        soft: tuple[Soft, ...],
    ) -> tuple[ca.Function, list[int]]:
        """The problem as a function that can be pickled, and how many rows each `Soft` has."""
        x, u = ca.SX.sym("x", self.states), ca.SX.sym("u", self.inputs)
        theta, d = ca.SX.sym("theta", self.names.size), ca.SX.sym("d", self.data_names.size)
        last: tuple[Symbols, ...] = (self.names.symbols(theta),)
        if self.data_names:
            last += (self.data_names.symbols(d),)
        arguments = {"x": x, "u": u, "theta": theta, "d": d}
        both, alone = ((x, u, *last), arguments), ((x, *last), {**arguments, "u": None})
        next_x = expression("model", model, *both, self.states, "state")
        cost = expression("stage", stage, *both, 1, "cost")
        final = expression("terminal", terminal, *alone, 1, "cost")
        first = expression("initial", initial, *alone, 1, "cost")
        rows = [expression(f"soft[{k}]", one.row, *both, 0, "row") for k, one in enumerate(soft)]
        together = ca.vertcat(ca.SX(0, 1), *rows)
        idle = ~_depends(together, ca.vertcat(x, u))
        for k, place in _each(rows):
            if idle[place]:
                raise ValueError(
                    f"soft[{k}] has a row that depends on neither x nor u: no plan can change it"
                )
        results = [next_x, cost, final, first, together]
        function = ca.Function("problem", [x, u, theta, d], results)
        return function, [row.numel() for row in rows]

    def _active(self, soft: tuple[Soft, ...], sizes: list[int]) -> NDArray[np.bool_]:
        """Which row holds at which stage, shape (N + 1, M)."""
        stages = np.arange(self.horizon + 1)
        active = np.zeros((stages.size, sum(sizes)), bool)
        ends = np.cumsum([0, *sizes])
        for k, (one, place) in enumerate(zip(soft, map(slice, ends[:-1], ends[1:]), strict=True)):
            on_inputs = self.on_inputs[place].any()
            try:
                chosen = stages if one.stages is None else np.atleast_1d(stages[one.stages])
            except (IndexError, TypeError) as error:
                raise ValueError(
                    f"soft[{k}].stages = {one.stages!r} must lie among 0, ..., {self.horizon}"
                ) from error
            if on_inputs and one.stages is None:
                chosen = stages[:-1]
            if on_inputs and self.horizon in chosen:
                raise ValueError(
                    f"soft[{k}] depends on u, and there is no input at stage {self.horizon}:"
                    " leave that stage out"
                )
            active[chosen, place] = True
        return active

    def _refuse_outside(self) -> None:
        for name in self.names:
            low, start, high = (
                self.names.part(name, v) for v in (self.theta_lower, self.theta, self.theta_upper)
            )
            if not ((low <= start) & (start <= high)).all():
                raise ValueError(f"theta {name!r} starts at {start}, outside {low} and {high}")


def discount(gamma: Any) -> float:
    """A discount factor.

    Raises:
        ValueError: it does not lie in (0, 1].
    """
    if not 0 < gamma <= 1:
        raise ValueError(f"gamma = {gamma} must lie in (0, 1]")
    return float(gamma)


def _bends(problem: Problem, share: float) -> tuple[Matrix, Matrix]:
    """Hessian and gradient in (x, u) of a stage's cost and a share of the last, around 0."""
    e = problem.expressions
    z, costs = ca.vertcat(e.x, e.u), e.stage + share * e.terminal
    both = ca.Function("bends", [e.x, e.u, e.theta, e.d], [*ca.hessian(costs, z)])
    still = np.clip(np.zeros(problem.inputs), problem.lower, problem.upper)
    curvature, slope = both(np.zeros(problem.states), still, problem.theta, problem.data[0])
    return curvature.full(), slope.full()


def _ones(problem: Problem) -> tuple[Vector, Vector]:
    return kept(np.ones(problem.states)), kept(np.ones(problem.inputs))


def _sizes(scale: Any, problem: Problem) -> tuple[Vector, Vector]:
    """In which units states and inputs are solved: powers of 2, so that nothing is rounded.

    Neither horizon nor gamma changes them, and with them what is compiled.
    """
    bends = np.diag(_bends(problem, 1.0)[0])
    usual = np.where((bends > 0) & (bends < np.inf), np.maximum(bends, LEAST) ** -0.5, 1.0)
    states, inputs = usual[: problem.states], usual[problem.states :]
    if scale is None and ((states > SMALL) & (states < LARGE)).all():
        return _ones(problem)
    if scale is not None:
        states = np.array(scale, float)
        if (
            states.shape not in ((), (1,), (problem.states,))
            or not ((states > 0) & (states < np.inf)).all()
        ):
            raise ValueError(
                f"scale = {scale!r} must hold {problem.states} positive numbers, one a state"
            )
    half = (problem.upper - problem.lower) / 2
    inputs = np.where(half < np.inf, half, inputs)
    rounded = (2.0 ** np.round(np.log2(size)) for size in (states, inputs))
    spread = zip(rounded, (problem.states, problem.inputs), strict=True)
    states, inputs = (kept(np.broadcast_to(size, count)) for size, count in spread)
    return states, inputs


def _spread(name: str, bound: Any, start: Matrix) -> Vector:
    try:
        return np.broadcast_to(np.asarray(bound, float), start.shape).ravel()
    except ValueError:
        raise ValueError(
            f"theta {name!r} has shape {start.shape} and a bound of shape {np.shape(bound)}"
        ) from None


def _bounds(lower: Any, upper: Any, inputs: int) -> tuple[Vector, Vector]:
    sides = []
    for name, value in (("lower", lower), ("upper", upper)):
        side = np.array(value, float)
        if side.shape not in ((), (1,), (inputs,)) or np.isnan(side).any():
            raise ValueError(f"{name} = {value!r} must hold {inputs} numbers, one an input")
        sides.append(kept(np.broadcast_to(side, inputs)))
    if not (sides[0] < sides[1]).all():
        raise ValueError(
            f"lower = {sides[0]} must lie below upper = {sides[1]}, or no input is allowed"
        )
    return sides[0], sides[1]


def _rows(soft: Any) -> tuple[Soft, ...]:
    found = tuple(soft) if isinstance(soft, Iterable) else (soft,)
    for k, one in enumerate(found):
        if not isinstance(one, Soft):
            raise ValueError(
                f"soft[{k}] = {one!r} must be a Soft: write soft=[Soft(row, weight=10.0)]"
            )
    return found


def _weights(soft: tuple[Soft, ...], sizes: list[int]) -> Vector:
    found = [np.zeros(0)]
    for k, (one, size) in enumerate(zip(soft, sizes, strict=True)):
        weight = np.array(one.weight, float)
        if weight.shape not in ((), (1,), (size,)):
            raise ValueError(f"soft[{k}] has {size} rows and {weight.size} weights")
        if not ((weight > 0) & np.isfinite(weight)).all():
            raise ValueError(f"soft[{k}].weight = {one.weight} must be positive")
        found.append(np.broadcast_to(weight, size))
    return np.concatenate(found)


def _depends(rows: ca.SX, variables: ca.SX) -> NDArray[np.bool_]:
    """Which rows depend on any of these."""
    if not rows.numel() or not variables.numel():
        return np.zeros(rows.numel(), bool)
    return np.array(ca.which_depends(rows, variables, 1, True), bool)


def _each(parts: list[ca.SX]) -> Iterator[tuple[int, int]]:
    """(part, place) of every row."""
    owners = [k for k, part in enumerate(parts) for _ in range(part.numel())]
    return ((k, place) for place, k in enumerate(owners))
