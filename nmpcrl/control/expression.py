"""Functions of a user evaluated in symbols, and refused where no solver can use them."""

import inspect
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import casadi as ca
import numpy as np

IF = "a Python `if`, `max` or `and` cannot wait for numbers: write ca.if_else(...), ca.fmax(...)"
INFINITE = "write a large number, or leave out what has no bound"
NAN = "math's functions make nan of a symbol: write ca.sin(x) for math.sin(x), and so on"


def expression(
    name: str,
    function: Callable[..., Any] | None,
    arguments: tuple[Any, ...],
    symbols: Mapping[str, Any],
    size: int,
    unit: str,
) -> ca.SX:
    """A user's function in symbols, a column of `size` entries, or of any if 0; else ValueError."""
    if function is None:
        return ca.SX(0)
    signature = [key for key, one in symbols.items() if one is not None and one.numel()]
    call = f"{name}({', '.join('th' if key == 'theta' else key for key in signature)})"
    if not callable(function):
        raise ValueError(f"{name} = {function!r} must be a function, called as {call}")
    wrong = mismatch(function, arguments)
    if wrong:
        raise ValueError(f"{name} is called as {call}, and does not take that: {wrong}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FutureWarning)  # CasADi's, of np.sin and its like
            written = _column(function(*arguments))
    except ValueError:
        raise
    except Exception as error:
        reason = (str(error).strip() or "nothing is said").splitlines()[-1]
        why = IF if "truth value" in reason else f"{reason} ({type(error).__name__})"
        raise ValueError(f"{name} cannot be written down in symbols: {why}") from error
    if written is None:
        raise ValueError(
            f"{name} must return a column of SX, as its arguments are: write ca.vertcat(...)"
        )
    if not written.numel() or size not in (0, written.numel()):
        needed = f"{size} {unit}{'s' if size > 1 else ''}" if size else f"a {unit} or more"
        raise ValueError(f"{name} returns {written.numel()} numbers; it must return {needed}")
    _refuse_unusable(
        name, written, ca.vertcat(*(one for one in symbols.values() if one is not None))
    )
    return written


def mismatch(function: Callable[..., Any], arguments: tuple[Any, ...]) -> str:
    """Why a function cannot be called with these arguments; "" if it can, or Python cannot tell."""
    try:
        inspect.signature(function).bind(*arguments)
    except ValueError:
        return ""
    except TypeError as error:
        return str(error)
    return ""


def place(name: str, row: int, size: int) -> str:
    """The name of an entry of an expression: "model[1]", or "stage" for the only one."""
    return f"{name}[{row}]" if size > 1 else name


def _column(result: Any) -> ca.SX | None:
    """A result as a column; None for anything else."""
    if isinstance(result, ca.MX):
        return None
    if isinstance(result, list | tuple | np.ndarray):
        result = ca.vertcat(*np.ravel(np.array(result, object)))
    try:
        written = ca.SX(result)
    except NotImplementedError:
        return None
    return ca.densify(ca.vec(written)) if 1 in written.shape else None


def _refuse_unusable(name: str, written: ca.SX, allowed: ca.SX) -> None:
    """Refuse symbols besides the `allowed` ones, and numbers that are not finite."""
    known = {one.__hash__() for one in ca.vertsplit(allowed)}
    for row, entry in enumerate(ca.vertsplit(written)):
        called = place(name, row, written.numel())
        for symbol in ca.symvar(entry):
            if symbol.__hash__() not in known:
                raise ValueError(
                    f"{called} uses {symbol}, which is none of its arguments: make it a parameter"
                    " in theta, or data"
                )
        flat = ca.Function("flat", ca.symvar(entry), [entry])
        for k in range(flat.n_instructions()):
            constant = flat.instruction_constant(k)
            if flat.instruction_id(k) == ca.OP_CONST and not np.isfinite(constant):
                advice = NAN if np.isnan(constant) else INFINITE
                raise ValueError(f"{called} holds {constant}: {advice}")
    try:
        ca.jacobian(written, allowed)
    except Exception as error:
        reason = str(error).strip().splitlines()[-1]
        raise ValueError(f"{name} cannot be differentiated by CasADi: {reason}") from error


def refuse_other(usage: str, function: Any, arguments: int) -> None:
    """Refuse a function that does not take so many arguments."""
    wrong = mismatch(function, (None,) * arguments)
    if wrong:
        raise ValueError(f"{usage}: {wrong}")
