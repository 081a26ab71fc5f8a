"""`nmpcrl clean`: makes room among the stored runs."""

from typing import TYPE_CHECKING

import click

from nmpcrl.commands.tables import columns, size

if TYPE_CHECKING:
    from nmpcrl.study.cleaning import Leftover

KINDS = ("damaged", "half", "failed", "old", "pictures")
LISTED = 20  # files of a kind that are named


@click.command()
@click.option("--yes", "-y", is_flag=True, help="Delete what is listed.")
@click.option("--only", type=click.Choice(KINDS), multiple=True, help="Of this kind alone.")
@click.option("--runs", is_flag=True, help="The finished runs and summaries as well.")
def clean(yes: bool, only: tuple[str, ...], runs: bool) -> None:
    """List the stored files that can go; --yes deletes them.

    \b
    damaged   files that were found damaged and set aside
    half      files that a killed process left half written, an hour ago or more
    failed    notes of runs of the study that failed
    old       runs of other code, or of other versions of the libraries
    pictures  what `nmpcrl show` drew

    A finished run of this code stays, unless --runs is given.

    \b
    Example:
      nmpcrl clean --only old --only damaged --yes
    """
    from nmpcrl.analysis import summaries
    from nmpcrl.study import store
    from nmpcrl.study.cleaning import leftovers, remove

    wanted = [*(only or KINDS), *(["runs"] * runs)]
    names = {store.folder(): store.path_of, summaries.folder(): summaries.path_of}
    found = [one for one in leftovers(names) if one.kind in wanted]
    if not found:
        click.echo(f"Nothing in {store.folder()} can go.")
        return
    if yes:
        gone = sum(one.bytes for one in remove(found))
        click.echo(f"{len(found)} files are deleted: {size(gone)}")
    else:
        _list(found)


def _list(found: "list[Leftover]") -> None:
    """What would go and why, and how much room that makes."""
    from nmpcrl.study.cleaning import KINDS as WORDS

    for kind, words in WORDS.items():
        mine = [one for one in found if one.kind == kind]
        if mine:
            click.echo(f"{kind}: {words}, {size(sum(one.bytes for one in mine))}")
            rows = [["", str(one.path), size(one.bytes)] for one in mine[:LISTED]]
            for line in columns(rows, frozenset({2})):
                click.echo(line)
        if len(mine) > LISTED:
            click.echo(f"  and {len(mine) - LISTED} others")
    whole = size(sum(one.bytes for one in found))
    click.echo(f"{len(found)} files, {whole}; nothing is deleted: --yes does it")
