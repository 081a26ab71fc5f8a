"""What commands share whose runs come in parts: which are asked for, and what is stored of them."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import click

from nmpcrl.commands.tables import counted, duration

OPTIONS = (
    click.option("--workers", metavar="N", type=int, help="Processes; by default one per core."),
    click.option("--dry-run", is_flag=True, help="Only report what is missing, and its price."),
    click.option("--publish", is_flag=True, help="Put what is whole beside what is published."),
    click.option("--judge", is_flag=True, help="Only say what the published runs say."),
    click.option("--yes", "-y", is_flag=True, help="Start more workers than there is room for."),
)


def options(command: Callable[..., None]) -> Callable[..., None]:
    """The options of all of them."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def some(given: tuple[str, ...], known: tuple[str, ...], what: str) -> tuple[str, ...]:
    """Those that are given, in their order, or all."""
    unknown = [one for one in given if one not in known]
    if unknown:
        raise click.ClickException(
            f"there is no {what} {unknown[0]!r}; there are {', '.join(known)}"
        )
    return tuple(one for one in known if not given or one in given)


def report(
    wanted: Mapping[str, tuple[Any, ...]],
    stored: Callable[[Iterable[Any]], Mapping[Any, Any]],
    price: Callable[[Iterable[Any], Mapping[Any, Any]], float],
) -> None:
    """Say how many runs of each part are stored, and what the others take."""
    found = stored(one for runs in wanted.values() for one in runs)
    total = 0.0
    for part, runs in wanted.items():
        missing = [one for one in runs if one not in found]
        left = price(missing, found)
        total += left
        words = f"; the others take about {duration(left)} of one core" if missing else ""
        count = counted(len(runs), "run")
        click.echo(f"{part}: {len(runs) - len(missing)} of {count} are stored{words}")
    click.echo(f"all that is missing: about {duration(total)} of one core")


def say_counts(question: str, words: str, counts: Mapping[str, tuple[int, int]]) -> None:
    """Say what became of a question."""
    said = ", ".join(f"{yes} of {of} {name}" for name, (yes, of) in counts.items())
    click.echo(f"{question}: {words} ({said})")
