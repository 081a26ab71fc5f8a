"""`nmpcrl remedies`: tune, judge and publish what may help where learning fails."""

from typing import TYPE_CHECKING

import click

from nmpcrl.commands.places import refuse_unwritable
from nmpcrl.commands.tables import columns, counted, duration
from nmpcrl.commands.workers import check

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nmpcrl.claims.remedies import Advice

HEAD = ("entry", "try it", "gain at 50", "gain at 300", "solved at 50", "CPU time", "tuning")


@click.command()
@click.option("--part", "parts", multiple=True, help="Only this part, such as best or tune.")
@click.option("--entry", "entries", multiple=True, help="Only this entry, such as CMA-ES.")
@click.option("--workers", metavar="N", type=int, help="Processes; by default one per core.")
@click.option("--dry-run", is_flag=True, help="Only report what is missing, and its price.")
@click.option("--publish", is_flag=True, help="Put what is whole beside what is published.")
@click.option("--judge", is_flag=True, help="Only say what the published runs advise.")
@click.option("--yes", "-y", is_flag=True, help="Start more workers than there is room for.")
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
    from nmpcrl.claims import published, remedy_published, remedy_runs
    from nmpcrl.claims.remedy_questions import SETTINGS
    from nmpcrl.study.storage.place import refuse_file

    if judge:
        _say()
        return
    refuse_file()
    chosen = _some(parts, remedy_runs.ORDER, "part")
    some = _some(entries, tuple(SETTINGS), "entry")
    check(workers, sure=yes)
    if publish:
        refuse_unwritable(published.place())
    if dry_run:
        _report(chosen, some)
        return
    remedy_runs.judge_parts(chosen, some, workers=workers)
    if publish:
        click.echo(f"{remedy_published.extend(remedy_runs.whole(some))}: published")
        _say()


def _some(given: tuple[str, ...], known: tuple[str, ...], what: str) -> tuple[str, ...]:
    """Those that are given, in their order, or all."""
    unknown = [one for one in given if one not in known]
    if unknown:
        raise click.ClickException(
            f"there is no {what} {unknown[0]!r}; there are {', '.join(known)}"
        )
    return tuple(one for one in known if not given or one in given)


def _report(parts: tuple[str, ...], entries: tuple[str, ...]) -> None:
    """How many runs of each part are stored, and what the others take."""
    from nmpcrl.analysis.judgements import stored
    from nmpcrl.claims import remedy_runs

    wanted = {part: remedy_runs.planned(part, entries) for part in parts}
    found = stored(one for runs in wanted.values() for one in runs)
    total = 0.0
    for part, runs in wanted.items():
        missing = [one for one in runs if one not in found]
        left = remedy_runs.price(missing, found)
        total += left
        words = f"; the others take about {duration(left)} of one core" if missing else ""
        count = counted(len(runs), "run")
        click.echo(f"{part}: {len(runs) - len(missing)} of {count} are stored{words}")
    click.echo(f"all that is missing: about {duration(total)} of one core")


def _say() -> None:
    """What to try, and each question's answer."""
    from nmpcrl.claims import remedies, remedy_published

    found = remedy_published.load().table
    for line in columns([HEAD, *map(cells, remedies.advice(found))], right=frozenset((5, 6))):
        click.echo(line)
    for answer in remedies.answers(found):
        counts = ", ".join(f"{yes} of {of} {name}" for name, (yes, of) in answer.counts.items())
        click.echo(f"{answer.question}: {answer.words} ({counts})")
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
