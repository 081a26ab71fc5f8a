"""Runs by name: a stored one's, its beginning, or a path."""

import re
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

from nmpcrl.commands.tables import counted

if TYPE_CHECKING:
    from nmpcrl.study import Records

SHOWN = 5  # names that a refusal lists
WHOLE = re.compile(r"(?P<learner>[^-]+)-(?P<layout>[^-]+)-(?P<decay>[a-z]+)-seed(?P<seed>\d+)")


class RunName(click.types.StringParamType):
    """A stored run, which `file_of` finds; the shell completes its name."""

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """The names of the stored runs that begin so."""
        return [CompletionItem(name) for name in names() if name.startswith(incomplete)]


def names() -> list[str]:
    """Of the stored runs, damaged or not."""
    from nmpcrl.study.store import folder

    return sorted(path.stem for path in folder().glob("*.npz"))


def trials() -> list[Path]:
    """The files of the stored trials, which have a folder of their own."""
    from nmpcrl.study.store import TRIALS, folder

    return sorted((folder() / TRIALS).glob("*.npz"))


def say_of_trials(consequence: str) -> None:
    """Say on standard error how many trials are stored, if any, and what that means here."""
    if found := trials():
        count = counted(len(found), "trial")
        click.echo(f"{count} of your own in {found[0].parent}: {consequence}", err=True)


def file_of(run: str) -> Path:
    """The file of the run that is meant.

    Raises:
        click.ClickException: it is none, or one of several; it lists the names that come close.
    """
    from nmpcrl.study.store import folder

    if run.endswith(".npz") and Path(run).is_file():
        return Path(run)
    stored, wanted = names(), run.removesuffix(".npz")
    begin = [wanted] if wanted in stored else [name for name in stored if name.startswith(wanted)]
    if len(begin) > 1 and (whole := _as_in_the_paper(wanted)) in begin:
        begin = [whole]
    if len(begin) == 1:
        return folder() / f"{begin[0]}.npz"
    if begin:
        raise click.ClickException(f"{run!r} is the beginning of several runs: {_listed(begin)}")
    for path in trials():
        if path.stem == wanted:
            raise _no_experiment(path)
    near = get_close_matches(wanted[:80], stored, n=SHOWN, cutoff=0.5) or stored
    raise click.ClickException(
        f"there is no run {run!r} in {folder()}; stored runs: {_listed(near)}"
    )


def _no_experiment(path: Path) -> click.ClickException:
    """The refusal of a trial's file."""
    return click.ClickException(
        f"{path} is a run of a Trial and not of the paper's robot: `nmpcrl.study.fetch(trial)`"
        " reads it, and `nmpcrl.report.figures.runs.trials` draws it"
    )


def _as_in_the_paper(wanted: str) -> str:
    """The name of the run that is as long as the paper's and differs in nothing that is not named.

    "" if a learner, a layout, a reading and a seed are not what is named.
    """
    from nmpcrl.study import Experiment
    from nmpcrl.study.parameters import ParameterError
    from nmpcrl.study.store import path_of

    found = WHOLE.fullmatch(wanted)
    try:
        named = {**found.groupdict(), "seed": int(found["seed"])} if found else {}
        return path_of(Experiment(**named)).stem if named else ""  # type: ignore[arg-type]
    except ParameterError:
        return ""


def records_of(path: Path) -> "Records":
    """What a file of `file_of` holds, if it is the run that its name in the folder says.

    Raises:
        click.ClickException: it is another run, or of a trial.
        DamagedRecords: it cannot be read whole.
    """
    from nmpcrl.study import Experiment, Records
    from nmpcrl.study.store import folder, name_of

    records = Records.load(path)
    if "layout" not in records.experiment:
        raise _no_experiment(path)
    key = records.facts.get("key", "")[:10]
    said = f"{name_of(Experiment(**records.experiment))}-{key}"
    if key and path.parent == folder() and path.stem != said:
        raise click.ClickException(f"{path} holds another run, {said}: give it that name")
    return records


def _listed(found: list[str]) -> str:
    """The first of some names, and how many others there are."""
    others = len(found) - SHOWN
    more = f" and {counted(others, 'other')}" if others > 0 else ""
    return (", ".join(found[:SHOWN]) or "none") + more
