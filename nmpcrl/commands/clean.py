"""`nmpcrl clean`: deletes stored files that are not needed."""

from typing import TYPE_CHECKING

import click

from nmpcrl.commands.names import say_of_trials
from nmpcrl.commands.tables import columns, counted, size

if TYPE_CHECKING:
    from nmpcrl.study.cleaning import Leftover

KINDS = ("damaged", "half", "failed", "old", "pictures")
LISTED = 20  # files of a kind that are named


@click.command()
@click.option("--yes", "-y", is_flag=True, help="Delete the listed files.")
@click.option("--only", type=click.Choice(KINDS), multiple=True, help="Only files of this kind.")
@click.option("--runs", is_flag=True, help="Finished runs and summaries, too.")
def clean(yes: bool, only: tuple[str, ...], runs: bool) -> None:
    """List the stored files that are not needed; --yes deletes them.

    \b
    damaged   damaged files that were set aside
    half      unfinished files of killed processes, an hour old or more
    failed    reasons why runs of the study failed
    old       runs of other code, or of other versions of the libraries
    pictures  pages that `nmpcrl show` drew

    Finished runs of this code are kept unless --runs is given.

    \b
    Example:
      nmpcrl clean --only old --only damaged --yes
    """
    from nmpcrl.analysis import summaries
    from nmpcrl.study import store
    from nmpcrl.study.cleaning import leftovers, remove
    from nmpcrl.study.storage.place import refuse_file

    refuse_file()

    wanted = [*(only or KINDS), *(["runs"] * runs)]
    names = {store.folder(): store.path_of, summaries.folder(): summaries.path_of}
    found = [one for one in leftovers(names) if one.kind in wanted]
    say_of_trials("they are kept, for only your code can tell which of them it still reads")
    if not found:
        click.echo(f"Nothing in {store.folder()} can be deleted.")
        return
    if yes:
        gone = sum(one.bytes for one in remove(found))
        click.echo(f"{counted(len(found), 'file')} deleted: {size(gone)}")
    else:
        _list(found)


def _list(found: "list[Leftover]") -> None:
    """Print which files would be deleted and why, and how much room that frees."""
    from nmpcrl.study.cleaning import KINDS as WORDS

    for kind, words in WORDS.items():
        mine = [one for one in found if one.kind == kind]
        if mine:
            click.echo(f"{kind}: {words}, {size(sum(one.bytes for one in mine))}")
            rows = [["", str(one.path), size(one.bytes)] for one in mine[:LISTED]]
            for line in columns(rows, frozenset({2})):
                click.echo(line)
        if len(mine) > LISTED:
            click.echo(f"  and {counted(len(mine) - LISTED, 'other')}")
    whole = size(sum(one.bytes for one in found))
    click.echo(f"{counted(len(found), 'file')}, {whole}. Nothing is deleted; --yes deletes them.")
