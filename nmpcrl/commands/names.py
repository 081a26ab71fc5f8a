"""Runs by name: a stored one's, its beginning, or a path."""

from difflib import get_close_matches
from pathlib import Path

import click
from click.shell_completion import CompletionItem

from nmpcrl.commands.tables import counted

SHOWN = 5  # names that a refusal lists


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
    if len(begin) == 1:
        return folder() / f"{begin[0]}.npz"
    if begin:
        raise click.ClickException(f"{run!r} is the beginning of several runs: {_listed(begin)}")
    near = get_close_matches(wanted[:80], stored, n=SHOWN, cutoff=0.5) or stored
    raise click.ClickException(
        f"there is no run {run!r} in {folder()}; stored runs: {_listed(near)}"
    )


def _listed(found: list[str]) -> str:
    """The first of some names, and how many others there are."""
    others = len(found) - SHOWN
    more = f" and {counted(others, 'other')}" if others > 0 else ""
    return (", ".join(found[:SHOWN]) or "none") + more
