"""Formulas that a reader types: arithmetic with named variables, and nothing else is executed.

`book/_static/exercises/formula.js` reads the same language.
"""

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

LONGEST = 200  # characters
OPERATORS: dict[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: math.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
FUNCTIONS: dict[str, Callable[..., float]] = {
    "sqrt": math.sqrt,
    "exp": math.exp,
    "log": math.log,
    "sin": math.sin,
    "cos": math.cos,
    "abs": abs,
    "max": max,
    "min": min,
}


RAISED = re.compile("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")
DIGITS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
PRODUCT = re.compile(r"\d\s*[A-Za-z_(]|\)\s*[\w(]")  # without its sign


class FormulaError(ValueError):
    """A text is no formula of the variables that there are, or has no value; says why."""


def plain(text: str) -> str:
    """What is typed as it is printed, with a keyboard's signs: 2·10⁻⁷ as 2*10^-7."""
    text = text.replace("−", "-").replace("·", "*").replace("×", "*")
    return RAISED.sub(lambda power: "^" + power[0].translate(DIGITS), text)


def evaluated(text: str, values: Mapping[str, float]) -> float:
    """The value of a formula, where `^` is a power, too.

    Raises:
        FormulaError: it holds something else than numbers, variables, + - * / ^ and `FUNCTIONS`.
    """
    if len(text) > LONGEST:
        raise FormulaError(f"it has more than {LONGEST} characters")
    text = plain(text)
    try:
        tree = ast.parse(text.strip().replace("^", "**"), mode="eval").body
        return float(_value(tree, values))
    except (SyntaxError, RecursionError):
        why = "a product needs its *" if PRODUCT.search(text) else "it cannot be read"
        raise FormulaError(why) from None
    except (ArithmeticError, ValueError, TypeError) as error:
        if isinstance(error, FormulaError):
            raise
        raise FormulaError("it has no value everywhere") from None


def _value(node: ast.expr, values: Mapping[str, float]) -> Any:
    match node:
        case ast.Constant(value=float() | int() as value) if not isinstance(value, bool):
            return float(value)
        case ast.Name(id=name) if name in values:
            return values[name]
        case ast.Name(id=name):
            raise FormulaError(f"{name} is not among its variables")
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_value(left, values), _value(right, values))
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_value(operand, values))
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](*(_value(one, values) for one in args))
    raise FormulaError("it may hold numbers, variables, + - * / ^ and brackets")
