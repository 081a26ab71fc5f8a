"""`nmpcrl bench`: how long learning steps and solves take."""

import click


@click.command()
@click.option("--full", "length", flag_value="full", default=True, help="Measure for minutes.")
@click.option("--short", "length", flag_value="short", help="Measure what the book needs.")
@click.option("--smoke", "length", flag_value="smoke", help="Only check that it works.")
@click.option("--again", is_flag=True, help="Measure even if a table is stored.")
def bench(length: str, again: bool) -> None:
    """Measure how long learning steps and solves take.

    The table of learning steps is stored with the runs, and read from there.

    \b
    Example:
      nmpcrl bench --short
    """
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
