"""`nmpcrl evaluate`: a run's noise-free cost, and its last rollout."""

import click

from nmpcrl.commands.names import RunName, file_of, records_of


@click.command()
@click.argument("run", type=RunName())
def evaluate(run: str) -> None:
    """Print the noise-free cost and the last rollout of RUN.

    RUN is a name that `nmpcrl runs` lists, or its beginning.

    \b
    Example:
      nmpcrl evaluate GES-A-step-seed0
    """
    from nmpcrl.report.run import figures, verdict
    from nmpcrl.study.storage.place import harmless

    records = records_of(file_of(run))
    click.echo(harmless(verdict(records)))
    for name, value in figures(records).items():
        click.echo(harmless(f"{name:38} {value}"))
