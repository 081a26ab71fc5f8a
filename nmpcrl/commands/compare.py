"""`nmpcrl compare`: the differences of two runs."""

from typing import TYPE_CHECKING

import click

from nmpcrl.commands.names import RunName, file_of, records_of
from nmpcrl.commands.tables import columns, counted

if TYPE_CHECKING:
    from nmpcrl.analysis.comparison import Comparison


@click.command()
@click.argument("run", type=RunName())
@click.argument("other", type=RunName())
def compare(run: str, other: str) -> None:
    """Compare two runs.

    Prints the fields in which they differ, the results of both, whether their
    numbers are the same bit for bit, and the largest differences of theta and of
    the cost of a noise-free rollout.

    \b
    Example:
      nmpcrl compare ES-A-step-seed0 GES-A-step-seed0
    """
    paths = file_of(run), file_of(other)
    from nmpcrl.analysis import comparison
    from nmpcrl.report.run import figures, verdict
    from nmpcrl.study.storage.place import harmless

    first, second = map(records_of, paths)
    found = comparison.compare(first, second)
    rows = [["", "first", "second"]]
    rows += [[name, *map(_word, pair)] for name, pair in found.fields.items()]
    one, two = figures(first), figures(second)
    rows += [[name, value, two[name]] for name, value in one.items() if name != "theta"]
    click.echo(harmless(f"first   {paths[0].stem}: {verdict(first)}"))
    click.echo(harmless(f"second  {paths[1].stem}: {verdict(second)}\n"))
    for line in columns(rows):
        click.echo(harmless(line))
    click.echo(f"\ntheta   {one['theta']}\n        {two['theta']}\n")
    _print_differences(found)
    if found.warning:
        click.echo(f"Warning: {found.warning}", err=True)


def _print_differences(found: "Comparison") -> None:
    """Print how far the numbers are apart."""
    if found.same_bits:
        click.echo("All numbers but the measured times are equal bit for bit.")
        return
    names = ", ".join(found.differing)
    count = counted(len(found.differing), "column")
    click.echo(click.wrap_text(f"Numbers differ in {count}: {names}."))
    if found.theta:
        apart, name, episode = found.theta
        where = f"theta_{name}, episode {episode}"
        click.echo(f"Largest difference of theta: {apart:.4g} ({where}).")
    if found.cost:
        cost, after = found.cost
        when = f"after {counted(after, 'episode')}"
        click.echo(f"Largest difference of the cost of a noise-free rollout: {cost:.4g} ({when}).")


def _word(value: object) -> str:
    """A field's value in a table."""
    if isinstance(value, tuple):
        return ",".join(f"{one:g}" for one in value)
    return f"{value:g}" if isinstance(value, float) else str(value)
