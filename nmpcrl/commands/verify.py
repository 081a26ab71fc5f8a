"""`nmpcrl verify`: the runs of this machine against the published ones."""

from typing import TYPE_CHECKING

import click

from nmpcrl.commands.workers import check

if TYPE_CHECKING:
    from nmpcrl.claims.published import Published

RELOCKED = 60  # runs that are trained afresh before the code is locked anew


@click.command()
@click.option("--sample", type=click.IntRange(0), default=0, help="Train so many runs for it.")
@click.option("--relock", is_flag=True, help="Show that an edit changed no bit, and lock the code.")
@click.option("--workers", metavar="N", type=int, help="Processes; by default one a core.")
@click.option("--yes", "-y", is_flag=True, help="More workers than there is room for.")
def verify(sample: int, relock: bool, workers: int | None, yes: bool) -> None:
    """Hold the runs trained here against the published ones.

    \b
    Example:
      nmpcrl verify --sample 5
    """
    check(workers, sure=yes)
    from nmpcrl.claims import published

    known = published.load()
    if relock:
        _relock(known, sample or RELOCKED, workers)
    else:
        _compare(known, sample, workers)


def _relock(known: "Published", sample: int, workers: int | None) -> None:
    """Lock the code, if fresh runs have the bits that they had."""
    from nmpcrl.claims import verification

    done = verification.relock(known, sample, workers=workers)
    click.echo(
        f"{done.published + done.stored} fresh runs have the same bits, {done.published} as the"
        f" published ones and {done.stored} as those made here before: {done.lock} is written"
    )


def _compare(known: "Published", sample: int, workers: int | None) -> None:
    """Print every contradiction; exit code 1 if there is one."""
    from nmpcrl.analysis import summaries
    from nmpcrl.claims import published, verification

    drawn = set(verification.sample(known, sample)) if sample else set()
    own = [e for e in known.rows if e in drawn or summaries.path_of(e).exists()]
    if not own:
        raise click.ClickException(
            "no run of the study was trained here; --sample 5 trains five for this"
        )
    found = summaries.fetch_summaries(own, workers=workers)
    wrong = published.compare(found, known)
    exact = published.comparable(found, known)
    click.echo(
        f"{len(found)} runs: {len(exact)} held against the published ones bit for bit,"
        f" {len(found) - len(exact)} by distribution, {len(wrong)} contradictions"
    )
    if len(wrong):
        click.echo(wrong.to_string(index=False))
        raise SystemExit(1)
