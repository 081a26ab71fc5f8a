"""`nmpcrl show`: one page of pictures of a run."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from nmpcrl.commands.names import RunName, file_of, records_of
from nmpcrl.commands.places import NewFile

if TYPE_CHECKING:
    from nmpcrl.study import Records

FORMATS = ("svg", "png")


@click.command()
@click.argument("run", type=RunName())
@click.option("--out", metavar="PATH", type=NewFile(), help="By default next to the run.")
@click.option(
    "--format", "kind", type=click.Choice(FORMATS), help="By default as PATH ends, or svg."
)
@click.option("--frozen", is_flag=True, help="Train the frozen arm if it is not stored.")
def show(run: str, out: Path | None, kind: str | None, frozen: bool) -> None:
    """Draw one page of pictures of RUN, and print its path.

    They show the noise-free trajectory, theta, the cost with and without noise,
    and alpha ||phi||^2, which is above 2 where a step overshoots. The costs of the
    frozen arm, whose theta never moves, are drawn as well if it is stored.

    \b
    Example:
      nmpcrl show GES-A-step-seed0 --out ges.png
    """
    path = file_of(run)
    out, kind = _place(path, out, kind)
    from nmpcrl.report.figures.runs.run import run_page, write
    from nmpcrl.study.storage.atomic import write_whole
    from nmpcrl.study.storage.place import harmless

    records = records_of(path)
    figure = run_page(records, _frozen_arm(records, train=frozen))
    write_whole(out, lambda file: write(figure, file, kind))
    click.echo(harmless(str(out)))


def _place(run: Path, out: Path | None, kind: str | None) -> tuple[Path, str]:
    """Where the page goes and in which format; one follows from the other."""
    if out is None:
        kind = kind or FORMATS[0]
        return run.with_suffix(f".{kind}"), kind
    ending = out.suffix.lower().removeprefix(".")
    kind = kind or ending
    if kind not in FORMATS or ending not in (kind, ""):
        raise click.ClickException(
            f"the name of the file, {str(out)!r}, must end in .svg or .png and agree with --format"
        )
    return out, kind


def _frozen_arm(records: "Records", *, train: bool) -> "Records | None":
    """The frozen arm of a run, if it has one and that is stored or to be trained."""
    from nmpcrl.commands.progress import fetched
    from nmpcrl.study import Experiment
    from nmpcrl.study.experiment import frozen_arm
    from nmpcrl.study.records import DamagedRecords
    from nmpcrl.study.storage.place import say
    from nmpcrl.study.store import read

    if records.experiment["learner"] == "frozen":
        return None
    arm = frozen_arm(Experiment(**records.experiment))
    if train:
        return fetched(arm)
    try:
        return read(arm)
    except FileNotFoundError:
        return None
    except DamagedRecords as error:
        say(f"{error}; it is not drawn")
        return None
