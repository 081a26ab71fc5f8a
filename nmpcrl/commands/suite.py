"""`nmpcrl suite`: one row for any learner, tuner or policy."""

from typing import TYPE_CHECKING

import click

from nmpcrl.commands.tables import columns
from nmpcrl.commands.workers import check

if TYPE_CHECKING:
    from nmpcrl.analysis.leaderboard import Row

HEAD = ("entry", "layouts", "solved", "gain", "episodes", "CPU time")
MOVING_HEAD = (HEAD[0], "scenarios", *HEAD[2:], "never inside")


@click.command()
@click.option("--policy", metavar="ENTRY", help="MODULE:FACTORY, or what ships, such as ES.")
@click.option("--moving", is_flag=True, help="The 40 scenarios in which obstacles move.")
@click.option("--budget", type=int, default=300, show_default=True, help="Episodes a layout.")
@click.option("--layouts", metavar="N", type=int, help="Only the first N of the 120, or 40.")
@click.option("--seeds", metavar="N", type=int, default=2, show_default=True, help="A layout.")
@click.option("--workers", metavar="N", type=int, help="Processes; by default one per core.")
@click.option("--list", "listed", is_flag=True, help="Only list what ships.")
@click.option("--yes", "-y", is_flag=True, help="Start more workers than there is room for.")
def suite(
    policy: str | None,
    moving: bool,
    budget: int,
    layouts: int | None,
    seeds: int,
    workers: int | None,
    listed: bool,
    yes: bool,
) -> None:
    """Judge an entry on 120 layouts or among moving obstacles.

    An entry is a learner, a tuner or a policy, and was tuned on neither. FACTORY
    is a function of a Robot. It may begin as many of its episodes as the budget
    has, and returns theta or a policy from observations to actions. An entry
    that begins one more is disqualified.

    \b
    Example:
      nmpcrl suite --policy CMA-ES --budget 50
      nmpcrl suite --policy CMA-ES --budget 50 --moving
      nmpcrl suite --policy my_tuner:factory --layouts 10
    """
    from nmpcrl.analysis import leaderboard
    from nmpcrl.analysis.entries import ENTRIES

    if listed:
        for name in ENTRIES:
            click.echo(name)
        return
    if policy is None:
        raise click.ClickException("--policy says what is judged: MODULE:FACTORY, or what ships")
    check(workers, sure=yes)
    table = leaderboard.MOVING if moving else leaderboard.STILL
    row = leaderboard.judge(
        policy, table, budget=budget, layouts=layouts, seeds=seeds, workers=workers
    )
    lines = [MOVING_HEAD, (*cells(row), f"{row.clear:.0%}")] if moving else [HEAD, cells(row)]
    for line in columns(lines, right=frozenset((1, 4, 5))):
        click.echo(line)
    if row.disqualified:
        raise click.ClickException(f"{row.entry} is disqualified: {row.disqualified}")


def cells(row: "Row") -> tuple[str, ...]:
    """The words of a row."""
    said = f"{row.solved:.0%}", f"{row.gain:.1%}"
    if row.disqualified:
        said = "disqualified", "disqualified"
    return (row.entry, str(row.layouts), *said, str(row.episodes), f"{row.seconds:.0f} s")
