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

OTHER_CODE = "code that is neither this nor locked: its numbers may be others"
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

    A run of code that makes other numbers is read, and that is said.

    Raises:
        click.ClickException: it is another run, or of a trial.
        DamagedRecords: it cannot be read whole.
    """
    from nmpcrl.study import Experiment, Records
    from nmpcrl.study.provenance import is_accepted, locked_hash, warn_of_changes
    from nmpcrl.study.storage.place import say
    from nmpcrl.study.store import name_of

    records = Records.load(path)
    if "layout" not in records.experiment:
        raise _no_experiment(path)
    name, key = name_of(Experiment(**records.experiment)), records.facts.get("key", "")[:10]
    for kept in _kept_as(path):
        if not key:
            raise click.ClickException(
                f"{path} does not say which code made it: keep it in another folder"
            )
        if kept != f"{name}-{key}":
            raise click.ClickException(f"{path} holds another run, {name}-{key}: give it that name")
    if not is_accepted(records.facts.get("sources", locked_hash())):
        say(f"{path} holds a run of {OTHER_CODE}")
    warn_of_changes()
    return records


def _kept_as(path: Path) -> list[str]:
    """The names that a file has in the folder of the runs, however its path is written."""
    from nmpcrl.study.store import folder

    places = {path.parent.resolve() / path.name, path.resolve()}
    return [place.stem for place in places if place.parent == folder().resolve()]


def _listed(found: list[str]) -> str:
    """The first of some names, and how many others there are."""
    others = len(found) - SHOWN
    more = f" and {counted(others, 'other')}" if others > 0 else ""
    return (", ".join(found[:SHOWN]) or "none") + more
