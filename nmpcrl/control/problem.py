"""Optimal control in which any symbol can be learned: a `Problem` is given to `Nmpc`.

    min   V0(s, theta) + sum_i gamma^i l(x_i, u_i, theta, d_i) + gamma^N V_f(x_N, theta, d_N)
          + sum_i gamma^i W' sigma_i
    s.t.  x_0 = s,  x_{i+1} = f(x_i, u_i, theta, d_i),  lower <= u_i <= upper,
          h(x_i, u_i, theta, d_i) <= sigma_i,  sigma_i >= 0,  g(x_i, u_i, theta, d_i) <= 0

f, l, V_f, V0, h and g are functions that return CasADi's SX, which is differentiated.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control.blocks import Blocks, by_name, numbers
from nmpcrl.control.content import Described
from nmpcrl.control.expression import expression
from nmpcrl.control.vectors import box, integer, read_only, spread

SMALL, LARGE = 1e-2, 1e4  # sizes of states and rows between which solvers need no scaling
LEAST = 1e-200  # curvature or slope that counts


@dataclass(frozen=True, eq=False)
class Parameter:
    """The start of learned numbers, and their bounds for learners that project.

    A weight of a cost, which must not turn negative, is Parameter(start, lower=0).
    """

    start: Any  #: a number or an array
    lower: Any = -np.inf  #: a number, or one for each
    upper: Any = np.inf


@dataclass(frozen=True, eq=False)
class Soft:
    """Rows h <= sigma, sigma >= 0, with a discounted cost of `weight` for a unit of each slack."""

    row: Callable[..., Any]  #: (x, u, th) -> h, a number or a column; with d where there are data
    #: W > 0, a number, or one a row; or th -> W, a learned number: slacks are then in units of cost
    weight: Any = 1.0
    stages: Any = None  #: where they hold: an index, a slice or a list in 0, ..., N; all if None
    #: a table in data, each line of which has these rows, and is d[each]; only they see it
    each: str | None = None


@dataclass(frozen=True, eq=False)
class Hard:
    """Rows h <= 0; where no plan satisfies all, riccati's plan violates them least."""

    each: ClassVar[str | None] = None

    row: Callable[..., Any]  #: as in `Soft`
    stages: Any = None  #: as in `Soft`


Rows = dict[str, Soft | Hard]  # by name in messages


@dataclass(frozen=True, eq=False)
class Series:
    """Data that differ between stages: the default where `Nmpc.solve` is given none."""

    values: Any  #: an array with a first axis of N + 1


class Expressions(NamedTuple):
    """A problem in symbols."""

    x: ca.SX
    u: ca.SX
    theta: ca.SX
    d: ca.SX  #: of one stage
    line: ca.SX  #: of the table of `Soft.each`
    next_x: ca.SX
    stage: ca.SX
    terminal: ca.SX
    initial: ca.SX
    fixed: ca.SX  #: h and then g, without the rows of lines
    each: ca.SX  #: the rows of one line


class Problem(Described):
    """The optimal control problem that an NMPC solves, in symbols of which each may be learned.

    A problem of any functions can be pickled and copied: it keeps their expressions.
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
        hard: Hard | Sequence[Hard] = (),
        lower: Any = -np.inf,
        upper: Any = np.inf,
        state_lower: Any = -np.inf,
        state_upper: Any = np.inf,
        gamma: float = 1.0,
        data: Mapping[str, Any] | None = None,
        scale: Any = None,
    ) -> None:
        """Evaluate the functions in symbols and refuse what no solver can use.

        The functions take SX and return SX: `x` and `u` are columns, `th["A"]` is the parameter A
        in its shape. With data, the last argument of every function is `d`: `d["price"]` is the
        price of the stage; a table of `Soft.each` alone is an argument of its rows alone.

        Args:
            states: n.
            inputs: m.
            horizon: N, the number of planned inputs.
            theta: the learned parameters by name: an array to start from, or a `Parameter`.
            model: (x, u, th) -> x+, a discrete-time map; `rk4` makes one of a derivative.
            stage: (x, u, th) -> l.
            terminal: (x, th) -> V_f, 0 if absent.
            initial: (x, th) -> V0 of the state in which the plan begins, 0 if absent.
            soft: rows with a price, a `Soft` or several. A kink in a cost is written as rows:
                w |h| is Soft(lambda x, u, th: ca.vertcat(h, -h), weight=w).
            hard: rows without slacks, a `Hard` or several.
            lower: least input, a number or one an input.
            upper: largest input.
            state_lower: least state of stages 1, ..., N, a hard bound; a number or one a state.
            state_upper: largest state.
            gamma: discount factor, 0 < gamma <= 1.
            data: known numbers of the stages by name: an array for all stages, or a `Series` of one
                for each; in an episode they are those of `data=` of `learn`, by name over its time.
            scale: typical sizes of the states, a number or one a state, used as units; by default
                1, or sizes read from the costs where these lie below 0.01 or above 10,000.
        """
        self.states = integer("states", states)
        self.inputs = integer("inputs", inputs)
        self.horizon = integer("horizon", horizon)
        if not 0 < gamma <= 1:
            raise ValueError(f"gamma = {gamma} must lie in (0, 1]")
        self.gamma = float(gamma)
        self.lower, self.upper = box("", lower, upper, self.inputs, "an input")
        self.state_lower, self.state_upper = box(
            "state_", state_lower, state_upper, self.states, "a state"
        )
        self._take_theta(theta)
        rows = {**_rows("soft", soft, Soft), **_rows("hard", hard, Hard)}
        known = by_name("data", data or {})
        named = {one.each for one in rows.values() if one.each is not None}
        if len(named) > 1 or not named <= {*known}:
            raise ValueError(f"each = {sorted(named)} must name one table in data")
        family = next(iter(named), None)
        self._take_data(known, family)
        self._write((model, stage, terminal, initial), rows, family)
        self.sizes = _sizes(scale, self)

    def _take_theta(self, theta: Mapping[str, Any]) -> None:
        """Set names, starts and bounds of the parameters."""
        starts, lower, upper = {}, [], []
        for name, one in by_name("theta", theta).items():
            given = one if isinstance(one, Parameter) else Parameter(one)
            starts[name] = start = numbers(f"theta {name}", given.start)
            low, high = (
                spread(f"theta {name}.{side}", getattr(given, side), start.shape, "an entry")
                for side in ("lower", "upper")
            )
            if not ((low <= start) & (start <= high)).all():
                raise ValueError(f"theta {name!r} starts at {start}, outside {low} and {high}")
            lower.append(low.ravel())
            upper.append(high.ravel())
        self.names = Blocks("theta", {name: start.shape for name, start in starts.items()})
        if not self.names.size:
            raise ValueError("theta is empty: name at least one parameter, or nothing is learned")
        self.theta = read_only(self.names.filled(np.zeros(self.names.size), starts))
        self.theta_lower, self.theta_upper = map(read_only, map(np.concatenate, (lower, upper)))

    def _take_data(self, data: Mapping[str, Any], family: str | None) -> None:
        """Set names and defaults of the data; the table `family` comes last."""
        arrays, shapes = {}, {}
        for name, one in sorted(data.items(), key=lambda item: item[0] == family):
            values = one.values if isinstance(one, Series) else one
            arrays[name] = numbers(f"data {name}", values, empty=name == family)
            shapes[name] = arrays[name].shape[isinstance(one, Series) :]
        if family and len(shapes[family]) != 2:
            raise ValueError(f"data {family!r} must be a table: its rows are of each line")
        self.data_names = Blocks("data", shapes)
        self.lines, self.width = shapes.pop(family, (0, 0)) if family else (0, 0)
        self.own_names = Blocks("data", shapes)
        empty: Matrix = np.zeros((self.horizon + 1, self.data_names.size))
        self.data = read_only(self.data_names.filled(empty, arrays))

    def _write(
        self,
        functions: tuple[Callable[..., Any] | None, ...],
        rows: Rows,
        family: str | None,
    ) -> None:
        """Set the function of all expressions, and weights, stages and inputs of the rows."""
        x, u = ca.SX.sym("x", self.states), ca.SX.sym("u", self.inputs)
        theta, d = ca.SX.sym("theta", self.names.size), ca.SX.sym("d", self.own_names.size)
        line = ca.SX.sym("line", self.width)
        th, known = self.names.symbols(theta), self.own_names.symbols(d)
        in_line = copy(known)
        if family:
            in_line[family] = line
        last = (th, known) if self.own_names else (th,)
        arguments = {"x": x, "u": u, "theta": theta, "d": d}
        both, alone = ((x, u, *last), arguments), ((x, *last), {**arguments, "u": None})
        of_line = ((x, u, th, in_line), {**arguments, "line": line})
        model, stage, terminal, initial = functions
        next_x = expression("model", model, *both, self.states, "state")
        cost = expression("stage", stage, *both, 1, "cost")
        final = expression("terminal", terminal, *alone, 1, "cost")
        first = expression("initial", initial, *alone, 1, "cost")
        none = ca.SX(0, 1), np.zeros(0), np.zeros((self.horizon + 1, 0), bool), np.zeros(0, bool)
        fixed, each = [none], [none]  # rows, W, at which stages they hold, whether they depend on u
        for name, one in rows.items():
            row = expression(name, one.row, *(of_line if one.each else both), 0, "row")
            if not _depends(row, ca.vertcat(x, u)).all():
                raise ValueError(
                    f"{name} has a row that depends on neither x nor u: no plan can change it"
                )
            size, on_inputs = row.numel(), _depends(row, u)
            held = _stages(name, one.stages, self.horizon, on_inputs=bool(on_inputs.any()))
            weight: Vector = np.full(size, np.inf)
            if isinstance(one, Soft):
                price: Any = one.weight
                if callable(price):  # W h with a price of 1 costs what h costs with W
                    price, factor = 1.0, (price, (th,), {"theta": theta}, 1, "weight")
                    row = row * expression(f"{name}.weight", *factor)
                weight = spread(f"{name}.weight", price, (size,), "a row", positive=True)
            group = each if one.each else fixed
            group.append((row, weight, np.tile(held[:, None], size), on_inputs))
        (fixed_rows, *of_fixed), (each_rows, *of_each) = (
            (ca.vertcat(*rows), *map(np.hstack, others))
            for rows, *others in (zip(*group, strict=True) for group in (fixed, each))
        )
        results = [next_x, cost, final, first, fixed_rows, each_rows]
        self._function = ca.Function("problem", [x, u, theta, d, line], results)
        self.weights, self.active, self.on_inputs = (
            np.hstack([once, *[again] * self.lines])
            for once, again in zip(of_fixed, of_each, strict=True)
        )

    @cached_property
    def expressions(self) -> Expressions:
        """The problem in symbols."""
        given = self._function.sx_in()
        return Expressions(*given, *self._function.call(given))

    @property
    def soft(self) -> NDArray[np.bool_]:
        """Whether a row has a slack."""
        found: NDArray[np.bool_] = np.isfinite(self.weights)
        return found

    def own(self, data: Any) -> Any:
        """The data of one stage or of all without the lines."""
        return data[..., : self.own_names.size]

    def rows(self, x: Any, u: Any, theta: Any, data: Any) -> ca.SX:
        """h and g of a stage with its data, lines last, shape (M,)."""
        return self._of_rows(self._function, x, u, theta, data)

    def _of_rows(self, function: ca.Function, x: Any, u: Any, theta: Any, data: Any) -> ca.SX:
        """The last two results of a function, of fixed rows and of a line, for all lines."""
        own, width = self.own_names.size, self.width
        given = x, u, theta, data[:own]
        fixed = function(*given, ca.DM.zeros(width))[-2]
        begins = range(own, own + self.lines * width, max(width, 1))
        each = [function(*given, data[at : at + width])[-1] for at in begins]
        return ca.vertcat(ca.SX(0, 1), fixed, *each)

    @cached_property
    def cost_scale(self) -> float:
        """Half of the costs' largest curvature at rest, or their largest slope."""
        curvature, slope = _bends(self, self.gamma**self.horizon)
        found = max(np.abs(curvature).max() / 2, np.abs(slope).max())
        return float(found) if 0 < found < np.inf else 1.0

    def row_sizes(self, rows: ca.SX) -> ca.SX:
        """Slope and curvature of each row along `sizes`; 1 if between `SMALL` and `LARGE`."""
        z, sizes = ca.vertcat(self.expressions.x, self.expressions.u), np.concatenate(self.sizes)
        slopes = ca.jacobian(rows, z)
        bends = (ca.jacobian(slopes[:, k], z[k]) * sizes[k] / 2 for k in range(sizes.size))
        found = ca.densify((ca.fabs(slopes) + ca.fabs(ca.horzcat(*bends))) @ ca.DM(sizes))
        usual = ca.logic_and(found > SMALL, found < LARGE)
        unknown = ca.logic_not(found < 1 / LEAST)  # or nan
        known: ca.SX = ca.if_else(ca.logic_or(usual, unknown), 1, found + LEAST)
        return known

    def all_row_sizes(self, x: Any, u: Any, theta: Any, data: Any) -> ca.SX:
        """`row_sizes` of all rows, in the order of `rows`."""
        e = self.expressions
        given = [e.x, e.u, e.theta, e.d, e.line]
        sizes = ca.Function("sizes", given, [self.row_sizes(e.fixed), self.row_sizes(e.each)])
        return self._of_rows(sizes, x, u, theta, data)

    @cached_property
    def typical_row_sizes(self) -> Vector:
        """The largest of `row_sizes` at states of -1, 0 and 1 times `sizes`, shape (M,).

        1 for a row that nothing moves there, as where its data are zeros.
        """
        given = [ca.DM(one) for one in (self.still, self.theta, self.data[0])]
        at = [self.all_row_sizes(ca.DM(k * self.sizes[0]), *given) for k in (-1, 0, 1)]
        found: Vector = np.max([ca.evalf(one).full().ravel() for one in at], axis=0, initial=0.0)
        return np.where(found > LEAST, found, 1.0)

    @cached_property
    def still(self) -> Vector:
        """The input nearest to 0."""
        return np.clip(np.zeros(self.inputs), self.lower, self.upper)

    @cached_property
    def solved(self) -> "Problem":
        """The problem that is solved, with states and inputs in units of `sizes`."""
        if all((size == 1).all() for size in self.sizes):
            return self
        (states, inputs), other = self.sizes, copy(self)
        x, u, *rest = given = self._function.sx_in()
        next_x, *costs = self._function(ca.DM(states) * x, ca.DM(inputs) * u, *rest)
        function = ca.Function("problem", given, [next_x / ca.DM(states), *costs])
        bounds = {"lower": read_only(self.lower / inputs), "upper": read_only(self.upper / inputs),
                  "state_lower": read_only(self.state_lower / states),
                  "state_upper": read_only(self.state_upper / states)}  # fmt: skip
        vars(other).update(_function=function, sizes=_ones(self), **bounds)
        return other

    @cached_property
    def machine_code(self) -> dict[str, Any]:
        """Functions compiled for this problem, by name."""
        return {}

    def step(
        self, x: Any, u: Any, theta: Any = None, *, data: Mapping[str, Any] | None = None
    ) -> Vector:
        """The model's next state f(x, u, theta, d), shape (n,).

        `theta` has shape (d,), its start if absent, and `data` are arrays of one stage by name.
        """
        found: Vector = self._stage_of(x, u, theta, data)[0].full().ravel()
        return found

    def cost(
        self, x: Any, u: Any, theta: Any = None, *, data: Mapping[str, Any] | None = None
    ) -> float:
        """What a stage of the plan costs: l(x, u, theta, d) + W' max(h(x, u, theta, d), 0).

        The rows h are the soft ones that hold at any stage before N; arguments as in `step`. A
        plant that charges a row at x is learned on with plans that do so at stage 0, too.
        """
        return float(self._stage_of(x, u, theta, data)[1])

    def plant(self, **values: Any) -> Callable[..., tuple[Vector, float, bool]]:
        """A plant that moves as this problem does with other parameters; its cost has the starts.

        learn(nmpc, plant=problem.plant(mass=1.3), start=[0.0]) is learning with a wrong mass. Where
        the problem has data, the plant is told time and data, and moves and costs with them.
        """
        truth = self.vector(**values)
        if not self.data_names:
            return lambda x, u, rng: (self.step(x, u, truth), self.cost(x, u), False)
        return lambda x, u, rng, t, d: (
            self.step(x, u, truth, data=d),
            self.cost(x, u, data=d),
            False,
        )

    def _stage_of(self, x: Any, u: Any, theta: Any, data: Mapping[str, Any] | None) -> Any:
        theta = self.theta if theta is None else theta
        numbers = (
            spread("x", x, (self.states,), "a state"),
            spread("u", u, (self.inputs,), "an input"),
            spread("theta", theta, self.theta.shape, "a parameter"),
        )
        return self._stage(*numbers, self.stage_data(data)[0])

    @cached_property
    def _stage(self) -> ca.Function:
        """(x, u, theta, data of a stage with all lines) -> next state, cost with that of rows."""
        (x, u, theta, *_), d = self.expressions, ca.SX.sym("d", self.data_names.size)
        own, line = d[: self.own_names.size], ca.DM.zeros(self.width)
        next_x, cost, *_ = self._function(x, u, theta, own, line)
        weights = np.where(self.active[:-1].any(axis=0) & self.soft, self.weights, 0.0)
        price = ca.dot(ca.DM(weights), ca.fmax(self.rows(x, u, theta, d), 0))
        return ca.Function("stage", [x, u, theta, d], [next_x, cost + price])

    def split(self, theta: Vector) -> dict[str, Any]:
        """The parts of theta, or of a gradient in theta, by name."""
        return self.names.split(np.asarray(theta, float))

    def vector(self, **values: Any) -> Vector:
        """theta with these parameters, and the starts of the others."""
        return self.names.filled(self.theta, values)

    @property
    def theta_sizes(self) -> Vector:
        """Typical sizes of theta, (d,): its starts, 1 for 0, infinite where no plan depends on it.

        The last is a constant of the value, as V0.
        """
        e, start = self.expressions, np.abs(self.theta)
        plan = ca.veccat(e.next_x, e.stage, e.terminal, e.fixed, e.each)
        held = np.array(ca.which_depends(plan, e.theta, 1), bool)
        return np.where(held, np.where(start > 0, start, 1.0), np.inf)

    def stage_data(self, values: Mapping[str, Any] | None) -> Matrix:
        """d_0, ..., d_N, shape (N + 1, size), with these values and the defaults of the others."""
        return self._known if values is None else self.data_names.filled(self.data, values)

    @cached_property
    def _known(self) -> Matrix:
        """A writeable copy of the data, for machine code refuses read-only arrays."""
        return self.data.copy()


def _bends(problem: Problem, share: float) -> tuple[Matrix, Matrix]:
    """Hessian and gradient in (x, u), at rest in 0, of l plus a share of V_f."""
    e = problem.expressions
    z, costs = ca.vertcat(e.x, e.u), e.stage + share * e.terminal
    both = ca.Function("bends", [e.x, e.u, e.theta, e.d], [*ca.hessian(costs, z)])
    data = problem.own(problem.data[0])
    curvature, slope = both(np.zeros(problem.states), problem.still, problem.theta, data)
    return curvature.full(), slope.full()


def _ones(problem: Problem) -> tuple[Vector, Vector]:
    return read_only(np.ones(problem.states)), read_only(np.ones(problem.inputs))


def _sizes(scale: Any, problem: Problem) -> tuple[Vector, Vector]:
    """The units of states and inputs: powers of 2, so that nothing is rounded.

    They depend on neither horizon nor gamma, and so does the compiled code.
    """
    bends = np.diag(_bends(problem, 1.0)[0])
    usual = np.where((bends > 0) & (bends < np.inf), np.maximum(bends, LEAST) ** -0.5, 1.0)
    states, inputs = usual[: problem.states], usual[problem.states :]
    if scale is not None:
        states = spread("scale", scale, states.shape, "a state", positive=True)
    elif ((states > SMALL) & (states < LARGE)).all():
        return _ones(problem)
    half = (problem.upper - problem.lower) / 2
    inputs = np.where(half < np.inf, half, inputs)
    states, inputs = (read_only(2.0 ** np.round(np.log2(size))) for size in (states, inputs))
    return states, inputs


def _rows(name: str, given: Any, kind: Any) -> Rows:
    """Rows by name in messages."""
    several = given if isinstance(given, Iterable) else (given,)
    found = {f"{name}[{k}]": one for k, one in enumerate(several)}
    for place, one in found.items():
        if not isinstance(one, kind):
            example = "Soft(row, weight=10.0)" if kind is Soft else "Hard(row)"
            raise ValueError(
                f"{place} = {one!r} must be a {kind.__name__}: write {name}=[{example}]"
            )
    return found


def _stages(name: str, asked: Any, last: int, *, on_inputs: bool) -> NDArray[np.bool_]:
    """Whether rows hold at each stage."""
    held = np.zeros(last + 1, bool)
    try:
        held[slice(last + 1 - on_inputs) if asked is None else asked] = True
    except (IndexError, TypeError) as error:
        raise ValueError(f"{name}.stages = {asked!r} must lie among 0, ..., {last}") from error
    if on_inputs and held[last]:
        raise ValueError(
            f"{name} depends on u, and there is no input at stage {last}: leave that stage out"
        )
    return held


def _depends(rows: ca.SX, variables: ca.SX) -> NDArray[np.bool_]:
    """Whether a row depends on any of the variables."""
    if not rows.numel() or not variables.numel():
        return np.zeros(rows.numel(), bool)
    return np.array(ca.which_depends(rows, variables, 1, True), bool)
