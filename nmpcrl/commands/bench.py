"""`nmpcrl bench`: how long solves, steps and runs take."""

import click

PROBLEMS = 100_000  # of a sweep


@click.command()
@click.option("--full", "length", flag_value="full", default=True, help="Minutes; the default.")
@click.option("--short", "length", flag_value="short", help="As short as the book needs it.")
@click.option("--smoke", "length", flag_value="smoke", help="To see that it works.")
@click.option("--again", is_flag=True, help="Measure even if there is a benchmark of this code.")
@click.option("--publish", is_flag=True, help="Only time the learners; publish C3 and C4 anew.")
@click.option(
    "--sweep",
    metavar="[N]",
    is_flag=False,
    flag_value=PROBLEMS,
    type=int,
    help=f"Solve N drawn problems, {PROBLEMS:,} by default, and count what became of them.",
)
def bench(length: str, again: bool, publish: bool, sweep: int | None) -> None:
    """Measure how long solves, steps and runs take.

    It is held against what is to be reached, and kept beside the runs.

    \b
    Example:
      nmpcrl bench --short
      nmpcrl bench --sweep 1000
    """
    if sweep is not None:
        _sweep(sweep)
    elif publish:
        _publish_timing()
    else:
        _print_times(length, again=again)


def _sweep(problems: int) -> None:
    """What became of so many drawn problems, and where that is kept."""
    from nmpcrl.bench import sweep

    click.echo(str(sweep.sweep(problems)))
    click.echo(f"{sweep.path()}: kept")


def _print_times(length: str, *, again: bool) -> None:
    """A row a figure, and where the benchmark is kept."""
    from nmpcrl.bench import suite, targets

    measured = suite.measure(length) if again else suite.read_or_measure(length)
    rows = targets.rows(measured)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        click.echo(" | ".join(map(str.ljust, row, widths)))
    about = measured["about"]
    took = f"{about['length']}, {about['date']}, {about['seconds']:.0f} s"
    click.echo(f"{suite.path()}: {took}; other programs had {about['others']:.0%} of the cores")


def _publish_timing() -> None:
    """Publish the verdicts on time anew, if the machine lets them be decided."""
    from nmpcrl.claims.publish import publish_timing
    from nmpcrl.claims.rule import UNDECIDABLE

    judged = publish_timing()
    for verdict in judged:
        click.echo(f"{verdict.claim}: {verdict.outcome}. {verdict.evidence}")
    if UNDECIDABLE in {verdict.outcome for verdict in judged}:
        raise click.ClickException("nothing is published: try again when the machine is idle")
