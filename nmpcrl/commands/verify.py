"""`nmpcrl verify`: compares the runs of this machine with the published ones."""

import click

from nmpcrl.commands.options import WORKERS


@click.command()
@click.option("--sample", metavar="N", default=0, help="Train N more runs and compare them.")
@click.option("--relock", is_flag=True, help="Check that an edit changes no bit; lock the code.")
@WORKERS
def verify(sample: int, relock: bool, workers: int | None) -> None:
    """Compare the runs trained here with the published ones.

    \b
    Example:
      nmpcrl verify --sample 5
    """
    from nmpcrl.analysis import summaries
    from nmpcrl.claims import published
    from nmpcrl.studies import reproduce
    from nmpcrl.study.parameters import whole

    known = published.load()
    whole(0, len(known.rows)).check("sample", sample)
    if relock:
        lock, there, here = reproduce.relock(known, sample or 60, workers=workers)
        said = f"{there + here} runs trained again gave the same bits"
        said = f"{said}, {there} as published, {here} as stored"
        if not there + here:
            said = "an epoch was raised, so that no run is comparable with earlier ones"
        click.echo(f"{said}: {lock}")
        return
    wanted = {e for e in known.rows if summaries.SUMMARIES.path_of(e).exists()}
    if sample:
        rest = {e: part for e, part in known.variants.items() if e not in wanted}
        wanted |= {*reproduce.sample(rest, sample)}
    if not wanted:
        raise click.ClickException(
            "no run of the study was trained here; --sample 5 trains five for the comparison"
        )
    found = summaries.fetch_summaries((e for e in known.rows if e in wanted), workers=workers)
    wrong, exact = reproduce.compare(found, known), len(reproduce.comparable(found, known))
    click.echo(
        f"runs compared with the published ones: {exact} bit for bit, {len(found) - exact} by"
        f" distribution; contradictions: {len(wrong)}"
    )
    if len(wrong):
        click.echo(wrong.to_string(index=False))
        raise SystemExit(1)
