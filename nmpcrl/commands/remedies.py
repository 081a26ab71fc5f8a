"""`nmpcrl remedies`: tune, judge and publish what may help where learning fails."""

from typing import TYPE_CHECKING

import click

from nmpcrl.commands import by_parts
from nmpcrl.commands.places import refuse_unwritable
from nmpcrl.commands.tables import columns
from nmpcrl.commands.workers import check

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nmpcrl.claims.remedies import Advice

HEAD = ("entry", "try it", "gain at 50", "gain at 300", "solved at 50", "CPU time", "tuning")


@click.command()
@click.option("--part", "parts", multiple=True, help="Only this part, such as best or tune.")
@click.option("--entry", "entries", multiple=True, help="Only this entry, such as CMA-ES.")
@by_parts.options
def remedies(
    parts: tuple[str, ...],
    entries: tuple[str, ...],
    workers: int | None,
    dry_run: bool,
    publish: bool,
    judge: bool,
    yes: bool,
) -> None:
    """Compare remedies, tuners and learners at equal interaction.

    What is compared, and how, was fixed before. The parts are best, tune,
    "judge 50", "judge 300", "named 50" and "named 300", in this order. Each
    run is stored, so it can be interrupted and started again.

    \b
    Example:
      nmpcrl remedies --part best --part tune --entry CMA-ES
      nmpcrl remedies --dry-run
    """
    from nmpcrl.analysis import judgements
    from nmpcrl.claims import published, remedy_published, remedy_runs
    from nmpcrl.claims.remedy_questions import SETTINGS
    from nmpcrl.study.storage.place import refuse_file

    if judge:
        _say()
        return
    refuse_file()
    chosen = by_parts.some(parts, remedy_runs.ORDER, "part")
    some = by_parts.some(entries, tuple(SETTINGS), "entry")
    check(workers, sure=yes)
    if publish:
        refuse_unwritable(published.place())
    if dry_run:
        wanted = {part: remedy_runs.planned(part, some) for part in chosen}
        by_parts.report(wanted, judgements.stored, remedy_runs.price)
        return
    remedy_runs.judge_parts(chosen, some, workers=workers)
    if publish:
        click.echo(f"{remedy_published.extend(remedy_runs.whole(some))}: published")
        _say()


def _say() -> None:
    """What to try, and each question's answer."""
    from nmpcrl.claims import remedies, remedy_published

    found = remedy_published.load().table
    for line in columns([HEAD, *map(cells, remedies.advice(found))], right=frozenset((5, 6))):
        click.echo(line)
    for answer in remedies.answers(found):
        by_parts.say_counts(answer.question, answer.words, answer.counts)
    for said, true in remedies.expectations(found).items():
        click.echo(f"expected that {said}: {'so it is' if true else 'it is not so'}")


def cells(advice: "Advice") -> "Sequence[str]":
    """The words of a row."""
    first, second = (advice.rows.get(f"judge {budget}") for budget in (50, 300))
    gains = (f"{one.gain:.2f}" if one else "–" for one in (first, second))
    known = first or second
    assert known
    solved = f"{known.solved:.0%}"
    return (
        advice.entry, advice.word, *gains, solved, f"{known.seconds:.1f} s", str(advice.tuning)
    )  # fmt: skip
