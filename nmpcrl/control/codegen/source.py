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
FUNCTIONS = [
    *("exp", "log", "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"),
    *("asinh", "acosh", "atanh", "expm1", "log1p", "erf"),
]
UNARY = {getattr(ca, f"OP_{name.upper()}"): f"math.{name}({{}})" for name in FUNCTIONS} | {
    ca.OP_ASSIGN: "{}",
    ca.OP_NEG: "-{}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "2.0 * {}",
    ca.OP_INV: "1.0 / {}",
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
    """An expression holds what cannot be compiled; the message says what."""


def source(
    function: ca.Function,
    *,
    returned: bool = False,
    matrices: Collection[str] = (),
    sparse: Collection[str] = (),
    added: Collection[str] = (),
    shifted: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """The Python function of the same name, as text; needs `math` and NumPy as `np`.

    Vectors come as arrays (k,), matrices as (k, l). Each result is written, zeros included, into an
    array that follows the arguments.

    Args:
        function: an SX function.
        returned: whether the only result, a scalar, is returned instead.
        matrices: arguments and results that are matrices even with a single column.
        sparse: results of which only the nonzeros are written.
        added: results whose nonzeros are added to the numbers in the array.
        shifted: arguments and results that begin at a row of an array, with the name of a further
            argument: the number of this row.

    Raises:
        CannotCompile: an operation is not known here, or the function is no expression of scalars.
    """
    if not function.is_a("SXFunction"):
        raise CannotCompile(f"{function.name()} is not an SX function")
    names, given = function.name_in(), function.sx_in()
    results = [
        one if name in sparse or name in added else ca.densify(one)
        for name, one in zip(function.name_out(), function.call(given), strict=True)
    ]
    out = ca.Function(function.name(), given, ca.cse(results), names, function.name_out())
    layout = _Layout(matrices, added, shifted)
    lines = [_line(out, k, returned, layout) for k in range(out.n_instructions())] or ["pass"]
    written = [] if returned else [f"{name}_" for name in out.name_out()]
    arguments = ", ".join([*names, *written, *dict.fromkeys(shifted.values())])
    return "\n    ".join([f"def {out.name()}({arguments}):", *lines]) + "\n"


class _Layout(NamedTuple):
    """Where entries of arguments and results are: see `source`."""

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


def _line(function: ca.Function, k: int, returned: bool, layout: _Layout) -> str:
    """Instruction k; work variables are called w0, w1, ..."""
    operation, into = function.instruction_id(k), function.instruction_output(k)
    of = function.instruction_input(k)
    if operation == ca.OP_CONST:
        return f"w{into[0]} = {_number(function.instruction_constant(k))}"
    if operation == ca.OP_INPUT:
        name = function.name_in(of[0])
        entry = layout.entry(name, function.sparsity_in(of[0]), of[1])
        return f"w{into[0]} = {name}[{entry}]"
    if operation == ca.OP_OUTPUT:
        if returned:
            return f"return w{of[0]}"
        name = function.name_out(into[0])
        entry = layout.entry(name, function.sparsity_out(into[0]), into[1])
        return f"{name}_[{entry}] {'+=' if name in layout.added else '='} w{of[0]}"
    if operation == ca.OP_CALL:
        raise CannotCompile(
            f"{function.name()} calls a function that is not written in SX; for a table of"
            " ca.interpolant, write ca.pw_lin(x, points, values)"
        )
    template = UNARY.get(operation) or BINARY.get(operation)
    if template is None:
        codes = (name for name in dir(ca) if name.startswith("OP_"))
        called = next(name for name in codes if getattr(ca, name) == operation)
        raise CannotCompile(f"{function.name()} holds CasADi's {called}, which is not known here")
    return f"w{into[0]} = " + template.format(*(f"w{i}" for i in of))


def _number(value: float) -> str:
    return repr(value) if math.isfinite(value) else f"math.{value}".replace("math.-", "-math.")
