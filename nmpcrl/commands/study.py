"""The main study, for `nmpcrl investigate main_study`."""

import click


def train(parts: tuple[str, ...], workers: int | None, *, dry_run: bool, publish: bool) -> None:
    """Train the runs of parts, by default of all, that are not stored, and publish all of these."""
    from nmpcrl.analysis import summaries
    from nmpcrl.study import design, published
    from nmpcrl.study.files import folder
    from nmpcrl.study.limits import seconds_of
    from nmpcrl.study.parameters import one_of

    every = design.whole_study()
    for part in parts:
        one_of(dict.fromkeys(every.values())).check("part", part)
    wanted = {e: part for e, part in every.items() if not parts or part in parts}
    if publish:
        published.folder().mkdir(parents=True, exist_ok=True)  # where it cannot be, before any work
    missing = [e for e in wanted if not summaries.SUMMARIES.path_of(e).exists()]
    stored = f"{len(wanted) - len(missing):,} of {len(wanted):,} runs are stored"
    hours = sum(map(seconds_of, missing)) / 3600
    click.echo(f"{stored} in {folder()}; the others take about {hours:.1f} h of one core")
    if dry_run:
        return
    found = summaries.fetch_summaries(wanted, workers=workers, strict=publish)
    if publish:
        from nmpcrl.studies.main_study import publish_study

        click.echo(f"{publish_study(found, wanted, anew=not parts)}: published")
        judge()
    if len(found) < len(wanted):
        raise SystemExit(1)  # the reasons are printed


def judge() -> None:
    """Print the verdicts on the published study, a line each."""
    from nmpcrl.claims.published import load

    for verdict in load().verdicts:
        click.echo(f"{verdict.claim} {verdict.words}")
