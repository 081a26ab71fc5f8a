"""Prose with numbers, and the library's own source, as Markdown that every notebook shows."""

import ast
import inspect
import re
from importlib.util import find_spec
from pathlib import Path
from textwrap import dedent
from typing import Any

from IPython.display import Markdown, display

import nmpcrl
from nmpcrl.report.cited import cited, finite, is_number

ROOT = Path(nmpcrl.__file__).parents[1]

# `{name}` or `{name:.2f}`, and neither `\\text{init}` nor `x_{max}` nor `\\frac{a}{b}`.
PLACEHOLDER = re.compile(r"(?<![\w\\^}\])])\{([^\W\d]\w*)(?::([^{}]*))?\}")


ELSEWHERE = "This paragraph is about the book's own run."


def say(template: str, *, when: bool = True, origin: str = "", **numbers: Any) -> None:
    """Display a paragraph of Markdown with its numbers filled in, as `filled` does.

    Args:
        template: Markdown.
        when: whether the runs are those that the paragraph interprets: of other runs it might tell
            what did not happen, so that one line says that it is about the book's own.
        origin: as in `filled`.
        numbers: by name.
    """
    text = filled(template, origin=origin, **numbers)
    _show(text if when else ELSEWHERE)


def filled(template: str, *, origin: str = "", **numbers: Any) -> str:
    """The template with `{name}` and `{name:.2f}` replaced; the braces of LaTeX stay.

    Args:
        template: Markdown.
        origin: whose numbers these are and from where, "720 runs published". A number outside
            formulas then carries its name and this: see `cited`.
        numbers: by name.

    Raises:
        NameError: a placeholder has no number, or a number no placeholder.
    """
    text = inspect.cleandoc(template)
    wanted = {found[1] for found in PLACEHOLDER.finditer(text)}
    if missing := wanted - set(numbers):
        raise NameError(f"no number is given for {{{min(missing)}}} in: {text}")
    if unused := set(numbers) - wanted:
        raise NameError(f"{min(unused)} is given, and there is no {{{min(unused)}}} in: {text}")

    def shown(found: re.Match[str]) -> str:
        name, form = found[1], found[2] or ""
        value = numbers[name]
        words = finite(value, form) if is_number(value) else format(value, form)
        if not origin or not is_number(value) or _in_formula(found):
            return words
        return cited(words, value, f"{name.replace('_', ' ')}: {origin}")

    return PLACEHOLDER.sub(shown, text)


def _in_formula(found: re.Match[str]) -> bool:
    """Whether a placeholder stands between dollar signs or back quotes."""
    before = found.string[: found.start()]
    return any(before.count(sign) % 2 for sign in ("$", "`"))


def scientific(value: float) -> str:
    """A small or large number for a formula: 3e-7 is `3 \\cdot 10^{-7}`."""
    digits, _, exponent = f"{value:e}".partition("e")
    power = f"10^{{{int(exponent)}}}"
    return power if float(digits) == 1 else rf"{float(digits):g} \cdot {power}"


def source(shown: Any, title: str = "") -> None:
    """Display where the library defines `shown`, as `listing` does; with a title it is folded."""
    text = listing(shown)
    _show(folded(text, title) if title else text)


def listing(shown: Any) -> str:
    """The file in which a function or class is defined, and its definition there, in Markdown.

    Args:
        shown: it, or "module:name" of one that only exists compiled.

    Raises:
        NameError: the module defines no such name.
    """
    of = shown if isinstance(shown, str) else f"{shown.__module__}:{shown.__qualname__}"
    module, _, name = of.partition(":")
    path = Path(str(find_spec(module).origin))  # type: ignore[union-attr]
    found: Any = ast.parse(text := path.read_text("utf-8"))
    for outer in name.split("."):
        found = next((one for one in found.body if getattr(one, "name", "") == outer), None)
        if found is None:
            raise NameError(f"{module} does not define {name}")
    first = min(one.lineno for one in (found, *found.decorator_list))
    lines = dedent("\n".join(text.splitlines()[first - 1 : found.end_lineno]))
    return f"`{path.relative_to(ROOT).as_posix()}`\n\n```python\n{lines}\n```"


def folded(text: str, title: str) -> str:
    """Markdown behind a title that opens it."""
    return f"<details><summary>{title}</summary>\n\n{text}\n\n</details>"


def _show(text: str) -> None:
    display(Markdown(text))  # type: ignore[no-untyped-call]
