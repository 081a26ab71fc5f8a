"""Optimal control in which any symbol can be learned: `Problem`, given to `Nmpc`.

    min   V0(s, theta) + sum_i gamma^i l(x_i, u_i, theta, d_i) + gamma^N V_f(x_N, theta, d_N)
          + sum_i gamma^i W' sigma_i
    s.t.  x_0 = s,  x_{i+1} = f(x_i, u_i, theta, d_i),  lower <= u_i <= upper,
          h(x_i, u_i, theta, d_i) <= sigma_i,  sigma_i >= 0

f, l, V_f, V0 and h are written once, in CasADi's SX; all their derivatives follow from that.
"""

import difflib
import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control.vectors import kept

IF = "a Python `if`, `max` or `and` cannot wait for numbers: write ca.if_else(...), ca.fmax(...)"
NAN = "math's functions make nan of a symbol: write ca.sin(x) for math.sin(x), and so on"


@dataclass(frozen=True, eq=False)
class Parameter:
    """Numbers that are learned: where they start and, for learners that project, their bounds."""

    start: Any  # a number or an array
    lower: Any = -np.inf  # a number, or one for each
    upper: Any = np.inf


@dataclass(frozen=True, eq=False)
class Soft:
    """Rows h <= sigma, sigma >= 0, whose slacks cost `weight` each, discounted."""

    row: Callable[..., Any]  # (x, u, th) -> h, a number or a column; with d where there are data
    weight: Any = 1.0  # W > 0, a number, or one a row
    stages: Any = (
        None  # among 0, ..., N: an index, a slice or a list; all that are possible if None
    )


class Blocks(Mapping[str, tuple[int, ...]]):
    """Named arrays, one after the other in a vector, each in the order of `np.ravel`."""

    def __init__(self, what: str, shapes: Mapping[str, tuple[int, ...]]) -> None:
        self._what, self._shapes = what, dict(shapes)
        sizes = [int(np.prod(shape)) for shape in self._shapes.values()]
        ends = np.cumsum([0, *sizes]).tolist()
        self.size: int = ends[-1]
        self._places = dict(zip(self._shapes, map(slice, ends[:-1], ends[1:]), strict=True))

    def __getitem__(self, name: str) -> tuple[int, ...]:
        return self._shapes[self.known(name)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._shapes)

    def __len__(self) -> int:
        return len(self._shapes)

    def known(self, name: str) -> str:
        """The name, if it is one.

        Raises:
            ValueError: it is none; with the nearest.
        """
        if name in self._shapes:
            return name
        near = difflib.get_close_matches(str(name), self._shapes, 1)
        meant = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(
            f"{self._what} has no {name!r}{meant} (it has {', '.join(self._shapes) or 'none'})"
        )

    def part(self, name: str, vector: Any) -> Any:
        """The entries of one name in a vector, or in the last axis of an array."""
        return vector[..., self._places[self.known(name)]]

    def split(self, vector: Vector) -> dict[str, Any]:
        """Every array by its name; a float where it is a single number."""
        arrays = {name: self.part(name, vector).reshape(self[name]) for name in self}
        return {name: a if a.shape else float(a) for name, a in arrays.items()}

    def symbols(self, vector: ca.SX) -> "Symbols":
        """The same of a vector of symbols, as a model reads them."""
        return Symbols(self, vector)

    def filled(self, base: Matrix, values: Mapping[str, Any]) -> Matrix:
        """A copy of `base`, vectors along its last axis, with these arrays in their places.

        Raises:
            ValueError: a name or a shape is another, or a number is not finite.
        """
        copy = np.array(base, float)
        for name, value in values.items():
            shape, whole = self[name], (*copy.shape[:-1], *self[name])
            array = _numbers(f"{self._what} {name}", value)
            if array.shape not in (shape, whole):
                either = f"{shape}" if whole == shape else f"{shape} or {whole}, a stage each"
                raise ValueError(
                    f"{self._what} {name!r} has shape {array.shape}; it must be {either}"
                )
            rows = array.reshape(*copy.shape[:-1], -1) if array.shape == whole else array.ravel()
            copy[..., self._places[name]] = rows
        return copy


class Symbols(Mapping[str, ca.SX]):
    """Symbols by name, in their shapes."""

    def __init__(self, blocks: Blocks, vector: ca.SX) -> None:
        self._blocks, self._vector = blocks, vector

    def __getitem__(self, name: str) -> ca.SX:
        shape = self._blocks[name]
        part = self._vector[self._blocks._places[name]]
        return ca.reshape(part, *shape[::-1]).T if len(shape) == 2 else part

    def __iter__(self) -> Iterator[str]:
        return iter(self._blocks)

    def __len__(self) -> int:
        return len(self._blocks)


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


class Problem:
    """What an NMPC minimises, in symbols of which each may be learned."""

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
        soft: Sequence[Soft] = (),
        lower: Any = -np.inf,
        upper: Any = np.inf,
        gamma: float = 1.0,
        data: Mapping[str, Any] | None = None,
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
            soft: rows that may be violated at a price.
            lower: least input, a number or one an input.
            upper: largest input.
            gamma: discount factor, 0 < gamma <= 1.
            data: what is known of every stage and not learned: by name, the array of one stage that
                is taken where `Nmpc.solve` is given none.

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
        starts = {name: _numbers(f"theta {name}", one.start) for name, one in parameters.items()}
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
        defaults = {name: _numbers(f"data {name}", one) for name, one in (data or {}).items()}
        self.data_names = Blocks("data", {name: one.shape for name, one in defaults.items()})
        one_stage = self.data_names.filled(np.zeros(self.data_names.size), defaults)
        self.data: Matrix = np.tile(one_stage, (self.horizon + 1, 1))
        self.data.setflags(write=False)
        self.soft = tuple(soft)
        self.expressions, sizes = self._written(model, stage, terminal, initial)
        self.weights = kept(_weights(self.soft, sizes))
        self.on_inputs = _depends(self.expressions.rows, self.expressions.u)
        self.active = self._active(sizes)

    @cached_property
    def scale(self) -> float:
        """What riccati divides the objective by: half of the costs' largest curvature, or slope."""
        e = self.expressions
        z, costs = ca.vertcat(e.x, e.u), e.stage + self.gamma**self.horizon * e.terminal
        sizes = ca.Function("sizes", [e.x, e.u, e.theta, e.d], [*ca.hessian(costs, z)])
        still = np.clip(np.zeros(self.inputs), self.lower, self.upper)
        curvature, slope = sizes(np.zeros(self.states), still, self.theta, self.data[0])
        found = max(np.abs(curvature.full()).max() / 2, np.abs(slope.full()).max())
        return float(found) if 0 < found < np.inf else 1.0

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
        return self.data if values is None else self.data_names.filled(self.data, values)

    def _written(
        self,
        model: Callable[..., Any],
        stage: Callable[..., Any],
        terminal: Callable[..., Any] | None,
        initial: Callable[..., Any] | None,
    ) -> tuple[Expressions, list[int]]:
        """The problem in symbols, and how many rows each `Soft` has."""
        x, u = ca.SX.sym("x", self.states), ca.SX.sym("u", self.inputs)
        theta, d = ca.SX.sym("theta", self.names.size), ca.SX.sym("d", self.data_names.size)
        last = (self.names.symbols(theta),)
        if self.data_names:
            last += (self.data_names.symbols(d),)
        arguments = {"x": x, "u": u, "theta": theta, "d": d}
        both, alone = ((x, u, *last), arguments), ((x, *last), {**arguments, "u": None})
        next_x = _expression("model", model, *both, self.states, "state")
        cost = _expression("stage", stage, *both, 1, "cost")
        final = _expression("terminal", terminal, *alone, 1, "cost")
        first = _expression("initial", initial, *alone, 1, "cost")
        rows = [
            _expression(f"soft[{k}]", one.row, *both, 0, "row") for k, one in enumerate(self.soft)
        ]
        found = Expressions(
            x, u, theta, d, next_x, cost, final, first, ca.vertcat(ca.SX(0, 1), *rows)
        )
        idle = ~_depends(found.rows, ca.vertcat(x, u))
        for k, place in _each(rows):
            if idle[place]:
                raise ValueError(
                    f"soft[{k}] has a row that depends on neither x nor u: no plan can change it"
                )
        return found, [row.numel() for row in rows]

    def _active(self, sizes: list[int]) -> NDArray[np.bool_]:
        """Which row holds at which stage, shape (N + 1, M)."""
        stages = np.arange(self.horizon + 1)
        active = np.zeros((stages.size, sum(sizes)), bool)
        ends = np.cumsum([0, *sizes])
        for k, (one, place) in enumerate(
            zip(self.soft, map(slice, ends[:-1], ends[1:]), strict=True)
        ):
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


def whole(name: str, number: Any) -> int:
    """A whole number, 1 or more.

    Raises:
        ValueError: it is none.
    """
    if isinstance(number, bool) or not isinstance(number, int | np.integer) or number < 1:
        raise ValueError(f"{name} = {number!r} must be a whole number, 1 or more")
    return int(number)


def discount(gamma: Any) -> float:
    """A discount factor.

    Raises:
        ValueError: it does not lie in (0, 1].
    """
    if not 0 < gamma <= 1:
        raise ValueError(f"gamma = {gamma} must lie in (0, 1]")
    return float(gamma)


def _numbers(name: str, value: Any) -> Matrix:
    """An array of at most two axes.

    Raises:
        ValueError: it holds something else than finite numbers.
    """
    try:
        array = np.array(value, float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {value!r} must be a number or an array of numbers") from None
    if array.size == 0 or not np.isfinite(array).all():
        raise ValueError(f"{name} = {value!r} must hold finite numbers")
    return array


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


def _expression(
    name: str,
    function: Callable[..., Any] | None,
    arguments: tuple[Any, ...],
    symbols: Mapping[str, Any],
    size: int,
    unit: str,
) -> ca.SX:
    """What a function of the user writes down: a column of `size` entries, of any size if 0.

    Raises:
        ValueError: it is no such expression.
    """
    if function is None:
        return ca.SX(size, 1) if size > 1 else ca.SX(0)
    signature = [key for key, one in symbols.items() if one is not None and one.numel()]
    call = f"{name}({', '.join('th' if key == 'theta' else key for key in signature)})"
    try:
        inspect.signature(function).bind(*arguments)
    except TypeError as error:
        raise ValueError(f"{name} is called as {call}, and does not take that: {error}") from None
    try:
        written = _column(function(*arguments))
    except ValueError:
        raise
    except Exception as error:
        reason = str(error).strip().splitlines()[-1]
        why = IF if "truth value" in reason else f"{reason} ({type(error).__name__})"
        raise ValueError(f"{name} cannot be written down in symbols: {why}") from error
    if written is None:
        raise ValueError(
            f"{name} must return a column of SX, as its arguments are: write ca.vertcat(...)"
        )
    if not written.numel() or size not in (0, written.numel()):
        needed = f"{size} {unit}{'s' if size > 1 else ''}" if size else f"a {unit} or more"
        raise ValueError(f"{name} returns {written.numel()} numbers; it must return {needed}")
    _refuse_unusable(name, written, [one for one in symbols.values() if one is not None])
    return written


def _column(result: Any) -> ca.SX | None:
    """A result as a column; None if it is none."""
    if isinstance(result, ca.MX):
        return None
    if isinstance(result, list | tuple | np.ndarray):
        result = ca.vertcat(*np.ravel(np.array(result, object)))
    try:
        written = ca.SX(result)
    except NotImplementedError:
        return None
    return ca.densify(ca.vec(written)) if 1 in written.shape else None


def _refuse_unusable(name: str, written: ca.SX, allowed: list[ca.SX]) -> None:
    known = {one.__hash__() for vector in allowed for one in ca.vertsplit(vector)}
    for symbol in ca.symvar(written):
        if symbol.__hash__() not in known:
            raise ValueError(
                f"{name} uses {symbol}, which is none of its arguments: make it a parameter in"
                " theta, or data"
            )
    flat = ca.Function("flat", ca.symvar(written), [written])
    constants = (
        flat.instruction_constant(k)
        for k in range(flat.n_instructions())
        if flat.instruction_id(k) == ca.OP_CONST
    )
    if any(np.isnan(one) for one in constants):
        raise ValueError(f"{name} holds nan: {NAN}")
    try:
        ca.jacobian(written, ca.vertcat(*allowed))
    except Exception as error:
        reason = str(error).strip().splitlines()[-1]
        raise ValueError(f"{name} cannot be differentiated by CasADi: {reason}") from error
