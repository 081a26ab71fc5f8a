"""`nmpcrl bench`: how long solves, steps and runs take."""

import click

PROBLEMS = 100_000  # of a sweep


@click.command()
@click.option("--full", "length", flag_value="full", default=True, help="Measure for minutes.")
@click.option("--short", "length", flag_value="short", help="Measure what the book needs.")
@click.option("--smoke", "length", flag_value="smoke", help="Only check that it works.")
@click.option("--again", is_flag=True, help="Measure even if a benchmark is stored.")
@click.option("--publish", is_flag=True, help="Only time the learners, and publish C3 and C4.")
@click.option(
    "--sweep",
    metavar="[N]",
    is_flag=False,
    flag_value=PROBLEMS,
    type=int,
    help=f"Solve N drawn problems, {PROBLEMS:,} by default, and count the outcomes.",
)
@click.option("--sizes", is_flag=True, help="Only time problems of many sizes, and beside mpcrl.")
def bench(length: str, again: bool, publish: bool, sweep: int | None, sizes: bool) -> None:
    """Measure how long solves, steps and runs take.

    The times are compared with targets, and stored with the runs.

    \b
    Example:
      nmpcrl bench --short
      nmpcrl bench --sweep 1000
    """
    if sweep is not None:
        from nmpcrl.bench import sweep as sweeps

        click.echo(f"{sweeps.sweep(sweep)}\n{sweeps.path()}: stored")
    elif sizes:
        from nmpcrl.bench import problem_times

        found = problem_times.make()
        for table in (found.sizes, found.peers):
            click.echo(table.round(1).to_string(index=False))
        click.echo(f"{problem_times.path()}: stored")
    elif publish:
        _publish_timing()
    else:
        _print_times(length, again=again)


def _print_times(length: str, *, again: bool) -> None:
    from nmpcrl.bench import suite, targets

    measured = suite.measure(length) if again else suite.read_or_measure(length)
    about = measured["about"]
    click.echo(targets.shown(targets.targets(measured)))
    click.echo(
        f"{suite.path()}: {about['length']}, {about['date']}, {about['seconds']:.0f} s;"
        f" other programs used up to {about['others']:.0%} of the cores"
    )


def _publish_timing() -> None:
    """Measure and publish the verdicts on time, if they can be decided on this machine."""
    from nmpcrl.claims.publish import publish_timing
    from nmpcrl.claims.verdict import UNDECIDABLE
    from nmpcrl.report.verdicts import evidence

    judged = publish_timing()
    for verdict in judged:
        click.echo(f"{verdict.claim}: {verdict.outcome}. {evidence(verdict)}")
    if UNDECIDABLE in {verdict.outcome for verdict in judged}:
        raise click.ClickException("nothing is published: try again when the machine is idle")
