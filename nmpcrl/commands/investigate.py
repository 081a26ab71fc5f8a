"""`nmpcrl investigate`: make, publish and judge the runs of the study, or rows like them."""

from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING

import click

from nmpcrl.commands.options import WORKERS

if TYPE_CHECKING:
    import pandas as pd

    from nmpcrl.studies.investigation import Investigation

BOOK = {  # the investigations of the book beside the main study, in `nmpcrl.studies`
    "agents": "agents:SAC_AND_TD3",
    "interventions": "interventions:INTERVENTIONS",
    "other_problems": "other_problems:OTHER_PROBLEMS",
    "population": "population:POPULATION",
    "population_layouts": "difficulty:DIFFICULTY",
    "remedies": "remedies:REMEDIES",
    "worlds": "worlds:WORLDS",
}


@click.command()
@click.argument("name", metavar="NAME|FILE.py")
@click.option("--part", "parts", multiple=True, help="Only this part; by default all.")
@WORKERS
@click.option("--dry-run", is_flag=True, help="Only report missing rows and their price.")
@click.option("--publish", is_flag=True, help="Add complete arms to the published table.")
@click.option("--judge", is_flag=True, help="Only print the answers of the published table.")
def investigate(
    name: str, parts: tuple[str, ...], workers: int | None, dry_run: bool, publish: bool,
    judge: bool,
) -> None:  # fmt: skip
    """Make and judge the rows of an investigation.

    NAME is one of the book's (main_study, agents, interventions, other_problems,
    population, population_layouts, remedies, worlds), or a Python file that
    defines one. Each row is stored as soon as it is made, so that it can be
    interrupted. The rows of main_study are runs; its parts are main, controls
    and the variants, and with --part they are published beside the others.

    \b
    Example:
      nmpcrl investigate main_study --dry-run
      nmpcrl investigate worlds --part moving
      nmpcrl investigate my_study.py --publish
    """
    if name == "main_study":
        if judge:
            _judge()
        else:
            _train(parts, workers, dry_run=dry_run, publish=publish)
        return
    from nmpcrl.study import published
    from nmpcrl.study.parameters import one_of

    one = _load(name)
    for part in parts:
        one_of(one.parts).check("part", part)
    if dry_run:
        _report(one, parts or tuple(one.parts))
        return
    if not judge:
        made = one.complete(parts, workers)
        if publish:
            click.echo(f"{one.publish()}: published")
            if one.unregistered or not one.registered:
                click.echo(
                    f"not registered: commit {name} before its rows are made (delete {one.log} and"
                    " the published files to make them again)"
                )
    _say(one, one.table() if judge or publish else made)
    registered = published.about(one.name, one.where).get("registered", "")
    if judge and one.source and one.registered != registered:
        click.echo(f"not registered: the table is older than {name}; delete it to publish it anew")


def _train(parts: tuple[str, ...], workers: int | None, *, dry_run: bool, publish: bool) -> None:
    """Train the runs of the study, or of parts, that are not stored; publish all of these."""
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
        _judge()
    if len(found) < len(wanted):
        raise SystemExit(1)  # the reasons are printed


def _judge() -> None:
    """Print the verdicts on the published study, a line each."""
    from nmpcrl.claims.published import load

    for verdict in load().verdicts:
        click.echo(f"{verdict.claim} {verdict.words}")


def _load(name: str) -> "Investigation":
    """An investigation by its name in `BOOK`, or of a file."""
    from nmpcrl.studies.investigation import of_file

    if name in BOOK:
        found: Investigation = resolve_name(f"nmpcrl.studies.{BOOK[name]}")
        return found
    if not name.endswith(".py"):
        known = ", ".join(["main_study", *BOOK])
        raise click.ClickException(f"{name!r} must be one of {known}, or a .py file")
    return of_file(Path(name))


def _report(one: "Investigation", parts: tuple[str, ...]) -> None:
    """The stored rows of each part, and the time that the others take."""
    from nmpcrl.study.refusal import Refusal

    for part in parts:
        try:
            rows, missing, seconds = one.price(part)
        except Refusal as error:
            click.echo(f"{part}: {error}")
            continue
        minutes = f"; the others take about {max(seconds / 60, 0.1):.1f} minutes of one core"
        click.echo(f"{part}: {rows - missing} of {rows} rows are stored{minutes * (missing > 0)}")


def _say(one: "Investigation", table: "pd.DataFrame") -> None:
    """The answer to each question, and the expected one where it differs."""
    from nmpcrl.studies.investigation import WORDS

    for question, answer in zip(one.questions, one.answers(table).values(), strict=True):
        counts = {**answer.counts, **answer.beside}
        said = ", ".join(f"{yes} of {of} {unit}" for unit, (yes, of) in counts.items())
        click.echo(f"{question.name}: {answer.words} ({said})")
        if question.expected != answer.outcome:
            click.echo(f"  expected: {WORDS.get(question.expected, question.expected)}")
