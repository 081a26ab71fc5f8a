"""CasADi expressions to Python text: `source` writes a Function down for numba to compile.

An SX Function is a list of scalar instructions. Each becomes one line of Python on floats, with
common subexpressions eliminated first, so numba compiles what a careful hand would have written.
"""

import math
from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import NamedTuple

import casadi as ca

# Stands above what machine code alone calls: a wrapper for Python takes long to compile, and
# counting who refers to an array takes a tenth of the time of what is called often.
INNER = (
    '@njit(error_model="numpy", forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True,'
    " _nrt=False)\n"
)
UNARY = {
    ca.OP_ASSIGN: "{}",
    ca.OP_NEG: "-{}",
    ca.OP_EXP: "math.exp({})",
    ca.OP_LOG: "math.log({})",
    ca.OP_SQRT: "math.sqrt({})",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "2.0 * {}",
    ca.OP_INV: "1.0 / {}",
    ca.OP_SIN: "math.sin({})",
    ca.OP_COS: "math.cos({})",
    ca.OP_TAN: "math.tan({})",
    ca.OP_ASIN: "math.asin({})",
    ca.OP_ACOS: "math.acos({})",
    ca.OP_ATAN: "math.atan({})",
    ca.OP_SINH: "math.sinh({})",
    ca.OP_COSH: "math.cosh({})",
    ca.OP_TANH: "math.tanh({})",
    ca.OP_ASINH: "math.asinh({})",
    ca.OP_ACOSH: "math.acosh({})",
    ca.OP_ATANH: "math.atanh({})",
    ca.OP_EXPM1: "math.expm1({})",
    ca.OP_LOG1P: "math.log1p({})",
    ca.OP_ERF: "math.erf({})",
    ca.OP_FABS: "abs({})",
    ca.OP_FLOOR: "np.floor({})",
    ca.OP_CEIL: "np.ceil({})",
    ca.OP_SIGN: "math.copysign(1.0, {0}) if {0} < 0.0 or {0} > 0.0 else {0}",
    ca.OP_NOT: "1.0 if {} == 0.0 else 0.0",
}
BINARY = {
    ca.OP_ADD: "{} + {}",
    ca.OP_SUB: "{} - {}",
    ca.OP_MUL: "{} * {}",
    ca.OP_DIV: "{} / {}",
    ca.OP_POW: "{} ** {}",
    ca.OP_CONSTPOW: "{} ** {}",
    ca.OP_FMIN: "min({}, {})",
    ca.OP_FMAX: "max({}, {})",
    ca.OP_ATAN2: "math.atan2({}, {})",
    ca.OP_HYPOT: "math.hypot({}, {})",
    ca.OP_COPYSIGN: "math.copysign({}, {})",
    ca.OP_FMOD: "math.fmod({}, {})",
    ca.OP_LT: "1.0 if {} < {} else 0.0",
    ca.OP_LE: "1.0 if {} <= {} else 0.0",
    ca.OP_EQ: "1.0 if {} == {} else 0.0",
    ca.OP_NE: "1.0 if {} != {} else 0.0",
    ca.OP_AND: "1.0 if {} != 0.0 and {} != 0.0 else 0.0",
    ca.OP_OR: "1.0 if {} != 0.0 or {} != 0.0 else 0.0",
    ca.OP_IF_ELSE_ZERO: "({1} if {0} != 0.0 else 0.0)",
}


class CannotCompile(Exception):
    """An expression holds what cannot be compiled, or numba is missing: the message says which."""


def source(
    function: ca.Function,
    *,
    returned: bool | None = None,
    matrices: Collection[str] = (),
    sparse: Collection[str] = (),
    added: Collection[str] = (),
    shifted: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """The Python function of the same name, as text; needs `math` and NumPy as `np`.

    Vectors come as arrays (k,), matrices as (k, l). A single scalar result is returned; otherwise
    each result is written, zeros included, into an array that follows the arguments.

    Args:
        function: an SX function.
        returned: whether the result is returned, if not as above.
        matrices: arguments and results that are matrices even where they have a single column.
        sparse: results of which the nonzeros are written and nothing else.
        added: results of which the nonzeros are added to what the array holds.
        shifted: arguments and results that begin at a row of an array, by the name of a further
            argument, a number, that says at which.

    Raises:
        CannotCompile: an operation is not known here, or the function is no expression of scalars.
    """
    if not function.is_a("SXFunction"):
        raise CannotCompile(f"{function.name()} is not an SX function")
    names = [function.name_in(i) for i in range(function.n_in())]
    given, results = _expressions(function, {*sparse, *added})
    out = ca.Function(function.name(), given, results, names, function.name_out())
    returned = returns(function) if returned is None else returned
    way = _Way(matrices, added, shifted)
    lines = [_line(out, k, returned, way) for k in range(out.n_instructions())] or ["pass"]
    written = [] if returned else [f"{name}_" for name in out.name_out()]
    arguments = ", ".join([*names, *written, *dict.fromkeys(shifted.values())])
    return "\n    ".join([f"def {out.name()}({arguments}):", *lines]) + "\n"


def returns(function: ca.Function) -> bool:
    """Whether the compiled function returns its result, a scalar, instead of writing it."""
    return function.n_out() == 1 and function.size_out(0) == (1, 1)


def _expressions(function: ca.Function, sparse: Collection[str]) -> tuple[list[ca.SX], list[ca.SX]]:
    """Arguments and results, dense unless `sparse`, common subexpressions eliminated."""
    arguments = function.sx_in()
    named = zip(function.name_out(), function.call(arguments), strict=True)
    return arguments, ca.cse([one if name in sparse else ca.densify(one) for name, one in named])


class _Way(NamedTuple):
    """How entries are written."""

    matrices: Collection[str]
    added: Collection[str]
    shifted: Mapping[str, str]

    def entry(self, name: str, sparsity: ca.Sparsity, nonzero: int) -> str:
        """The index of a nonzero in the dense argument or result."""
        rows, columns = sparsity.get_triplet()
        shift = self.shifted.get(name)
        row = f"{shift} + {rows[nonzero]}" if shift else str(rows[nonzero])
        vector = sparsity.size2() == 1 and name not in self.matrices
        return row if vector else f"{row}, {columns[nonzero]}"


def _line(function: ca.Function, k: int, returned: bool, way: _Way) -> str:
    """Instruction k; work variables are called w0, w1, ..."""
    operation, into = function.instruction_id(k), function.instruction_output(k)
    of = function.instruction_input(k)
    if operation == ca.OP_CONST:
        return f"w{into[0]} = {_number(function.instruction_constant(k))}"
    if operation == ca.OP_INPUT:
        name = function.name_in(of[0])
        entry = way.entry(name, function.sparsity_in(of[0]), of[1])
        return f"w{into[0]} = {name}[{entry}]"
    if operation == ca.OP_OUTPUT:
        if returned:
            return f"return w{of[0]}"
        name = function.name_out(into[0])
        entry = way.entry(name, function.sparsity_out(into[0]), into[1])
        return f"{name}_[{entry}] {'+=' if name in way.added else '='} w{of[0]}"
    template = UNARY.get(operation) or BINARY.get(operation)
    if operation == ca.OP_CALL:
        raise CannotCompile(
            f"{function.name()} calls a function that is not written in SX; for a table of"
            " ca.interpolant, write ca.pw_lin(x, points, values)"
        )
    if template is None:
        raise CannotCompile(
            f"{function.name()} holds CasADi's {_name(operation)}, which is not known here"
        )
    return f"w{into[0]} = " + template.format(*(f"w{i}" for i in of))


def _number(value: float) -> str:
    return repr(value) if math.isfinite(value) else f"math.{value}".replace("math.-", "-math.")


def _name(operation: int) -> str:
    """What CasADi calls an operation."""
    return next(n for n in dir(ca) if n.startswith("OP_") and getattr(ca, n) == operation)
