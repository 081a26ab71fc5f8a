"""An option for each field of an experiment, made from the class: its name, type, default, help."""

from collections.abc import Callable, Iterable
from dataclasses import Field, fields
from functools import cache
from typing import Any

import click
from click.shell_completion import CompletionItem

LISTS = ("--theta", "--layout", "--start", "--target")  # options whose value is many numbers
ALIASES = {"gated": " /--literal"}  # a second name of what switches a field off


class Name(click.types.StringParamType):
    """One of some names; the experiment refuses another, the shell completes these."""

    def __init__(self, choices: Iterable[str] = ()) -> None:
        """Complete these."""
        self.choices = tuple(choices)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """The names that begin so."""
        return [CompletionItem(one) for one in self.choices if one.startswith(incomplete)]


def vector(value: Any) -> tuple[float, ...]:
    """Numbers between commas or blanks; how many there are to be, the experiment says."""
    try:
        return tuple(map(float, value.replace(",", " ").split()))
    except AttributeError:
        return tuple(value)  # the default
    except ValueError:
        raise click.BadParameter(f"{value!r} is not a list of numbers such as 1,1,0.05.") from None


class OfExperiment(click.Command):
    """A command with an option for each field of `Experiment`, which `option` makes.

    They are made when they are asked for, so that no other command waits for the class.
    """

    option: Callable[["Field[Any]"], click.Option]

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """The options of the fields, and then those of the command itself."""
        return [*_options(type(self).option), *super().get_params(ctx)]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As ever, after a vector's numbers have been joined."""
        return super().parse_args(ctx, joined(args))


def setting(one: "Field[Any]") -> click.Option:
    """The option that sets a field."""
    return click.Option(
        _flags(one),
        type=_kind(one),
        default=one.default,
        show_default=True,
        help=_help(one),
        metavar=_metavar(one),
    )


def condition(one: "Field[Any]") -> click.Option:
    """The option that picks runs by a field; given again, runs of either value."""
    return click.Option(
        _flags(one),
        type=_kind(one),
        default=None,
        multiple=not isinstance(one.default, bool),
        help=_help(one, bounds=False),
        metavar=_metavar(one),
    )


class Settings(OfExperiment):
    """A command that takes an experiment."""

    option = staticmethod(setting)


class Conditions(OfExperiment):
    """A command that picks runs by the fields of their experiments."""

    option = staticmethod(condition)


@cache
def _options(make: Callable[["Field[Any]"], click.Option]) -> tuple[click.Option, ...]:
    from nmpcrl.study import Experiment

    return tuple(map(make, fields(Experiment)))


def joined(args: list[str]) -> list[str]:
    """Numbers that stand after one of `LISTS`, words with and without commas, as one word."""
    result: list[str] = []
    collecting = False
    for word in args:
        if collecting and _are_numbers(word):
            result[-1] += f",{word}"
        else:
            collecting = bool(result) and result[-1] in LISTS and _are_numbers(word)
            result.append(word)
    return result


def _are_numbers(word: str) -> bool:
    try:
        return [float(one) for one in word.split(",")] != []
    except ValueError:
        return False


def _flags(one: "Field[Any]") -> list[str]:
    """The option's names: `--beta-tdc`, and `--gated/--no-gated` of what is true or false."""
    name = one.name.replace("_", "-")
    if not isinstance(one.default, bool):
        return [one.name, f"--{name}"]
    alias = [ALIASES[one.name]] if one.name in ALIASES else []
    return [one.name, f"--{name}/--no-{name}", *alias]


def _kind(one: "Field[Any]") -> Any:
    """What a word on the command line is made into."""
    if isinstance(one.default, tuple):
        return vector
    if isinstance(one.default, str):
        allowed = one.metadata.get("allowed")
        return Name((allowed and allowed.choices) or ())
    return type(one.default)


def _metavar(one: "Field[Any]") -> str | None:
    if isinstance(one.default, bool):
        return None
    return {str: "NAME", tuple: "NUMBERS", int: "N", float: "X"}[type(one.default)]


def _help(one: "Field[Any]", *, bounds: bool = True) -> str:
    """What the field is, and what it may be."""
    said: str = one.metadata.get("help", "")
    allowed = one.metadata.get("allowed")
    if not bounds or not allowed or isinstance(one.default, bool):
        return said
    return f"{said.rstrip('.')}: {allowed.text}." if said else f"{allowed.text}."
