"""`nmpcrl remedies`: tune, judge and publish what may help where learning fails."""

from typing import TYPE_CHECKING, Any

import click

from nmpcrl.commands import by_parts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nmpcrl.claims.remedies import Advice

HEAD = ("entry", "try it", "gain at 50", "gain at 300", "solved at 50", "CPU time", "tuning")
ENTRY = click.option("--entry", "entries", multiple=True, help="Only this entry, such as CMA-ES.")


@click.command()
@by_parts.options("best or tune", ENTRY)
def remedies(parts: tuple[str, ...], entries: tuple[str, ...], **asked: Any) -> None:
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
    from nmpcrl.claims import remedy_published, remedy_runs
    from nmpcrl.claims.remedy_questions import SETTINGS

    def some() -> tuple[str, ...]:
        return by_parts.some(entries, tuple(SETTINGS), "entry")

    runs = by_parts.Runs(
        order=remedy_runs.ORDER,
        planned=lambda part: remedy_runs.planned(part, some()),
        stored=judgements.stored,
        price=remedy_runs.price,
        run=lambda chosen, **options: remedy_runs.judge_parts(chosen, some(), **options),
        extend=lambda _: remedy_published.extend(remedy_runs.whole(some())),
        say=_say,
    )
    by_parts.carry_out(runs, parts, **asked)


def _say() -> None:
    """What to try, and each question's answer."""
    import pandas as pd

    from nmpcrl.claims import remedies, remedy_published

    found = remedy_published.load().table
    rows = map(cells, remedies.advice(found))
    click.echo(pd.DataFrame(rows, columns=HEAD).to_string(index=False))
    by_parts.say_answers(remedies.answers(found))
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
