"""`nmpcrl verify`: compares the runs of this machine with the published ones."""

from dataclasses import replace
from typing import TYPE_CHECKING

import click

from nmpcrl.commands.tables import counted
from nmpcrl.commands.workers import check

if TYPE_CHECKING:
    from nmpcrl.claims.published import Published

RELOCKED = 60  # runs that are trained afresh before the code is locked anew


@click.command()
@click.option(
    "--sample", type=click.IntRange(0), default=0, help="Train so many more runs and compare them."
)
@click.option("--relock", is_flag=True, help="Check that an edit changes no bit; lock the code.")
@click.option("--workers", metavar="N", type=int, help="Processes; by default one per core.")
@click.option("--yes", "-y", is_flag=True, help="Start more workers than there is room for.")
def verify(sample: int, relock: bool, workers: int | None, yes: bool) -> None:
    """Compare the runs trained here with the published ones.

    \b
    Example:
      nmpcrl verify --sample 5
    """
    check(workers, sure=yes)
    from nmpcrl.claims import published

    known = published.load()
    if sample > len(known.rows):
        raise click.BadParameter(
            f"{sample} is more than the {len(known.rows):,} published runs.", param_hint="--sample"
        )
    if relock:
        _relock(known, sample or RELOCKED, workers)
    else:
        _compare(known, sample, workers)


def _relock(known: "Published", sample: int, workers: int | None) -> None:
    """Lock the code, if runs that are trained again have the same bits."""
    from nmpcrl.claims import verification

    done = verification.relock(known, sample, workers=workers)
    known_bits = {"published": done.published, "stored here": done.stored}
    parts = [f"{count} as {where}" for where, count in known_bits.items() if count]
    click.echo(
        f"{counted(done.published + done.stored, 'run')} trained again gave the same bits,"
        f" {' and '.join(parts)}: {done.lock} is written"
    )


def _compare(known: "Published", sample: int, workers: int | None) -> None:
    """Print every contradiction; exit code 1 if there is one."""
    from nmpcrl.analysis import summaries
    from nmpcrl.claims import comparison, verification

    stored = {e for e in known.rows if summaries.path_of(e).exists()}
    rest = {e: part for e, part in known.variants.items() if e not in stored}
    drawn = verification.sample(replace(known, variants=rest), sample) if sample else ()
    own = [e for e in known.rows if e in {*stored, *drawn}]
    if not own:
        raise click.ClickException(
            "no run of the study was trained here; --sample 5 trains five for the comparison"
        )
    found = summaries.fetch_summaries(own, workers=workers)
    wrong = comparison.compare(found, known)
    exact = comparison.comparable(found, known)
    ways = {"bit for bit": len(exact), "by distribution": len(found) - len(exact)}
    parts = [f"{count} {way}" for way, count in ways.items() if count]
    click.echo(
        f"{counted(len(found), 'run')} compared with the published ones, {' and '.join(parts)}:"
        f" {counted(len(wrong), 'contradiction')}"
    )
    if len(wrong):
        click.echo(wrong.to_string(index=False))
        raise SystemExit(1)
