"""`nmpcrl show`: one page of pictures of a run."""

from pathlib import Path

import click

from nmpcrl.commands.options import new_file
from nmpcrl.commands.runs import costs_of, stored_run


@click.command()
@click.argument("run")
@click.option("--out", metavar="PATH", type=new_file, help="PATH.svg or PATH.png; by default SVG.")
def show(run: str, out: Path | None) -> None:
    """Draw RUN on one page.

    RUN is a name that `nmpcrl runs` lists, or its beginning. The noise-free cost of
    RUN and the path of the page are printed. The page has the noise-free
    trajectory, theta, the cost with and without noise, and alpha ||phi||^2, which
    is above 2 where a step overshoots. The costs of the same run with a frozen
    theta are drawn as well if it is stored.

    \b
    Example:
      nmpcrl show GES-A-step-seed0 --out ges.png
    """
    path = stored_run(run)
    out = out or path.with_suffix(".svg")
    kind = out.suffix.lower().removeprefix(".")
    if kind not in ("svg", "png"):
        raise click.BadParameter(f"{str(out)!r} must end in .svg or .png.", param_hint="--out")
    from nmpcrl.report.figures.run import run_page
    from nmpcrl.study import Experiment, Records
    from nmpcrl.study.experiment import frozen_arm
    from nmpcrl.study.files import write_file
    from nmpcrl.study.lock import is_accepted, warn_of_changes
    from nmpcrl.study.store import RUNS

    records = Records.load(path)
    if "layout" not in records.experiment:
        raise click.ClickException(f"{path} is a run of a Trial, which only `fetch(trial)` reads")
    if not is_accepted(records.facts.get("sources")):
        click.echo(f"{path} is of other code, whose numbers may differ", err=True)
    warn_of_changes()
    arm = frozen_arm(Experiment(**records.experiment))
    figure = run_page(
        records, None if records.experiment["learner"] == "frozen" else RUNS.read(arm)
    )
    write_file(out, lambda file: file.write(figure.written(kind)))
    click.echo(f"{costs_of(records)}\n{out}")
