"""`nmpcrl study`: trains all runs of the book, or parts of them."""

from contextlib import nullcontext
from pathlib import Path

import click

from nmpcrl.commands.options import WORKERS, new_file


@click.command()
@click.option("--part", "parts", multiple=True, help="Only this part: main, controls or a variant.")
@WORKERS
@click.option("--scheduler", metavar="ADDRESS", help="Dask cluster that trains instead.")
@click.option("--dry-run", is_flag=True, help="Only report missing runs.")
@click.option("--table", metavar="PATH", type=new_file, help="Write a CSV row per episode.")
@click.option("--publish", is_flag=True, help="Write the runs to book/published.")
@click.option("--judge", is_flag=True, help="Only show the verdicts on the published study.")
def study(
    parts: tuple[str, ...], workers: int | None, scheduler: str | None, dry_run: bool,
    table: Path | None, publish: bool, judge: bool,
) -> None:  # fmt: skip
    """Train the runs of the study that are not stored.

    Finished runs are stored, so the study can be interrupted and started again.
    With --publish and --part, the runs of these parts are published beside the
    published ones.

    \b
    Example:
      nmpcrl study --part main --table episodes.csv.gz
    """
    from nmpcrl.analysis import summaries
    from nmpcrl.study import cluster, design, published
    from nmpcrl.study.files import folder
    from nmpcrl.study.limits import seconds_of
    from nmpcrl.study.parameters import one_of

    if judge:
        _judge()
        return
    every = design.whole_study()
    for part in parts:
        one_of(dict.fromkeys(every.values())).check("part", part)
    wanted = {e: part for e, part in every.items() if not parts or part in parts}
    if publish:
        published.folder().mkdir(parents=True, exist_ok=True)  # where it cannot be, before any work
    missing = [e for e in wanted if not summaries.SUMMARIES.is_stored(e)]
    stored = f"{len(wanted) - len(missing):,} of {len(wanted):,} runs are stored"
    hours = sum(map(seconds_of, missing)) / 3600
    click.echo(f"{stored} in {folder()}; the others take about {hours:.1f} h of one core")
    if dry_run:
        return
    with cluster.executor(scheduler) if scheduler else nullcontext() as executor:
        found = summaries.fetch_summaries(
            wanted, executor=executor, workers=workers, strict=publish
        )
    if table:
        import pandas as pd

        from nmpcrl.analysis.rows import tidy

        frames = [tidy(one).assign(variant=wanted[e]) for e, one in found.items()]
        pd.concat(frames).to_csv(table, index=False, float_format="%.7g")
        click.echo(f"{table}: written")
    if publish:
        from nmpcrl.studies.main_study import publish_study

        click.echo(f"{publish_study(found, wanted, anew=not parts)}: published")
        _judge()
    if len(found) < len(wanted):
        raise SystemExit(1)  # the reasons are printed


def _judge() -> None:
    """Print the verdicts on the published study, a line each."""
    from nmpcrl.claims.published import load

    for verdict in load().verdicts:
        click.echo(f"{verdict.claim} {verdict.words}")
