"""What commands share whose runs come in parts: run, publish, and say what was found."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from nmpcrl.commands.options import WORKERS, refuse_unwritable

Option = Callable[[Callable[..., None]], Callable[..., None]]
OPTIONS: tuple[Option, ...] = (
    WORKERS,
    click.option("--dry-run", is_flag=True, help="Only report what is missing, and its price."),
    click.option("--publish", is_flag=True, help="Put what is whole beside what is published."),
    click.option("--judge", is_flag=True, help="Only say what the published runs say."),
)


@dataclass(frozen=True)
class Runs:
    """The runs of a command, and what it publishes of them."""

    order: tuple[str, ...]  # of the parts
    planned: Callable[[str], tuple[Any, ...]]  # all of a part
    stored: Callable[[Iterable[Any]], Mapping[Any, Any]]
    price: Callable[[Iterable[Any], Mapping[Any, Any]], float]  # in seconds of one core
    run: Callable[..., None]  # what is missing of some parts, with so many workers
    extend: Callable[[tuple[str, ...]], Path]  # publishes what is whole
    say: Callable[[], None]  # what is published says


def options(example: str, *more: Option) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """The options of all of them.

    Args:
        example: parts that there are, in words.
        more: options of the command's own.
    """
    only = f"Only this part, such as {example}."
    every: tuple[Option, ...] = (
        click.option("--part", "parts", multiple=True, help=only),
        *more,
        *OPTIONS,
    )

    def decorated(command: Callable[..., None]) -> Callable[..., None]:
        for option in reversed(every):
            command = option(command)
        return command

    return decorated


def carry_out(
    runs: Runs,
    parts: tuple[str, ...],
    *,
    workers: int | None,
    dry_run: bool,
    publish: bool,
    judge: bool,
) -> None:
    """What such a command does."""
    from nmpcrl.claims import published
    from nmpcrl.study.storage.place import refuse_file

    if judge:
        runs.say()
        return
    refuse_file()
    chosen = some(parts, runs.order, "part")
    if publish:
        refuse_unwritable(published.place())
    if dry_run:
        report({part: runs.planned(part) for part in chosen}, runs.stored, runs.price)
        return
    runs.run(chosen, workers=workers)
    if publish:
        click.echo(f"{runs.extend(chosen)}: published")
        runs.say()


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
        words = f"; the others take about {left / 3600:.1f} h of one core" if missing else ""
        count = f"{len(runs):,} runs"
        click.echo(f"{part}: {len(runs) - len(missing)} of {count} are stored{words}")
    click.echo(f"all that is missing: about {total / 3600:.1f} h of one core")


def say_answers(answers: Iterable[Any], questions: Mapping[str, Any] | None = None) -> None:
    """Say what became of each question, and where another answer was expected.

    Args:
        answers: of `claims.population.Answer`.
        questions: by name, where an expectation is to be said.
    """
    from nmpcrl.claims.population_questions import WORDS

    for answer in answers:
        counts = {**answer.counts, **answer.beside}
        said = ", ".join(f"{yes} of {of} {name}" for name, (yes, of) in counts.items())
        click.echo(f"{answer.question}: {answer.words} ({said})")
        expected = questions[answer.question].expected if questions else answer.outcome
        if expected != answer.outcome:
            click.echo(f"  expected: {WORDS.get(expected, str(expected))}")
