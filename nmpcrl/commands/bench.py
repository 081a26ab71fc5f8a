"""`nmpcrl bench`: how long learning steps and solves take."""

import click


@click.command()
@click.option("--full", "length", flag_value="full", default=True, help="Measure for minutes.")
@click.option("--short", "length", flag_value="short", help="Measure what the book needs.")
@click.option("--smoke", "length", flag_value="smoke", help="Only check that it works.")
@click.option("--again", is_flag=True, help="Measure even if a table is stored.")
@click.option("--publish", is_flag=True, help="Only time the learners, and publish C3 and C4.")
def bench(length: str, again: bool, publish: bool) -> None:
    """Measure how long learning steps and solves take.

    The table of learning steps is stored with the runs, and read from there.

    \b
    Example:
      nmpcrl bench --short
    """
    if publish:
        _publish_timing()
    else:
        _print_times(length, again=again)


def _print_times(length: str, *, again: bool) -> None:
    from nmpcrl.bench import measurement, solves
    from nmpcrl.study import paper

    found = measurement.measure(length) if again else measurement.read_or_measure(length)
    click.echo("Learning steps [ms]; ratios are to a step of ES with the same solver:\n")
    click.echo(found.timings.drop(columns=["hours", "hours_paper"]).round(3).to_string(index=False))
    click.echo(
        f"\n{measurement.path()}: {found.length}, {found.date}, {found.seconds:.0f} s;"
        f" other programs used {found.others:.0%} of the cores"
    )
    click.echo("\nWarm solves of the same problems [us], with the gradient of the value:\n")
    click.echo(solves.compare(solves.solvers(), paper.nmpc()).round(2).to_string())


def _publish_timing() -> None:
    """Measure and publish the verdicts on time, if they can be decided on this machine."""
    from nmpcrl.claims.verdict import UNDECIDABLE
    from nmpcrl.studies.main_study import publish_timing

    judged = publish_timing()
    for verdict in judged:
        ratios = ", ".join(f"{ratio} with {solver}" for solver, ratio in verdict.numbers.items())
        click.echo(f"{verdict.claim}: {verdict.outcome}. In steps of ES: {ratios}")
    if UNDECIDABLE in {verdict.outcome for verdict in judged}:
        raise click.ClickException("nothing is published: try again when the machine is idle")
