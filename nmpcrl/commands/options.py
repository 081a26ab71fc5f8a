"""Options of several commands, and the type of a file to write."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])


def number(
    name: str, least: int, default: int | None, text: str, **options: Any
) -> Callable[[Command], Command]:
    """An option that takes a whole number, `least` or more."""
    kind = click.IntRange(least)
    return click.option(name, metavar="N", type=kind, default=default, help=text, **options)


WORKERS = number(
    "--workers",
    1,
    None,
    "Processes; by default, and at most, one per core.",
    callback=lambda ctx, param, count: count and min(count, os.cpu_count() or 1),
)


def new_file(value: str) -> Path:
    """The path of a file to write; refused before any work if it cannot be written."""
    path = Path(value)
    place = path if path.is_file() else path.parent
    if not value or path.is_dir() or not (path.parent.is_dir() and os.access(place, os.W_OK)):
        raise click.BadParameter(f"{value!r} cannot be written: name a file in a writable folder.")
    return path
