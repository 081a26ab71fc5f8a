"""`nmpcrl train`: one run, any field of it."""

from typing import TYPE_CHECKING, Any

import click

from nmpcrl.commands.fields import Settings

if TYPE_CHECKING:
    from nmpcrl.study import Experiment


@click.command(cls=Settings)
@click.option("--yes", "-y", is_flag=True, help="Train even if it takes more than a day.")
def train(yes: bool, **fields: Any) -> None:
    """Train one run and store it, or read it if it is stored.

    Each field of an experiment is an option; the defaults are the paper's.

    \b
    Example:
      nmpcrl train --learner RDES --layout B --episodes 50 --no-gated
      nmpcrl train --layout "0.5,2.2 3,0.5" --target 8,4,1.57
    """
    from nmpcrl.commands.progress import fetched
    from nmpcrl.report.run import verdict
    from nmpcrl.study import Experiment
    from nmpcrl.study.limits import afford, need_numba
    from nmpcrl.study.storage.place import harmless
    from nmpcrl.study.store import check_folder, path_of, size_of

    experiment = Experiment(**fields)
    path = path_of(experiment)
    if not path.is_file():
        if experiment.box == "soft":
            need_numba("only riccati, which it compiles, keeps to a soft box")
        afford([experiment], sure=yes or None, lift="--yes")
        check_folder(size_of(experiment))
    records = fetched(experiment)
    if not path.is_file():  # the store has said why
        click.echo(harmless(f"{experiment}: {records.facts['stopped']}"))
        click.echo(harmless(verdict(records)))
        raise SystemExit(1)
    click.echo(harmless(f"{path}: {records.facts['stopped']}"))
    click.echo(harmless(verdict(records)))
    click.echo(f"Next: nmpcrl show {path.stem}")
    click.echo(f"      nmpcrl compare {path.stem} {_other(experiment)}")


def _other(experiment: "Experiment") -> str:
    """The frozen arm of this run if it is stored; otherwise a placeholder for a name."""
    from nmpcrl.study.experiment import frozen_arm
    from nmpcrl.study.store import path_of

    arm = path_of(frozen_arm(experiment))
    return arm.stem if arm.is_file() and arm != path_of(experiment) else "RUN"
