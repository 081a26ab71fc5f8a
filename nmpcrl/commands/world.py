"""`nmpcrl world`: run, publish and judge worlds that move, change, or are not the model."""

import click

from nmpcrl.commands import by_parts
from nmpcrl.commands.places import refuse_unwritable
from nmpcrl.commands.workers import check


@click.command()
@click.option("--part", "parts", multiple=True, help="Only this part, such as moving.")
@by_parts.options
def world(
    parts: tuple[str, ...],
    workers: int | None,
    dry_run: bool,
    publish: bool,
    judge: bool,
    yes: bool,
) -> None:
    """Learn where obstacles move or the model is wrong.

    Or where layouts change between episodes. What is asked, and how, was
    fixed before. The parts are moving, model, once, "every 50", random,
    carry and gradient, in this order. Each run is stored, so it can be
    interrupted and started again.

    \b
    Example:
      nmpcrl world --part moving
      nmpcrl world --dry-run
    """
    from nmpcrl.analysis.worlds import KEPT
    from nmpcrl.claims import published, world_published, world_runs
    from nmpcrl.study.storage.place import refuse_file

    if judge:
        _say()
        return
    refuse_file()
    chosen = by_parts.some(parts, world_runs.ORDER, "part")
    check(workers, sure=yes)
    if publish:
        refuse_unwritable(published.place())
    if dry_run:
        wanted = {part: world_runs.planned(part) for part in chosen}
        by_parts.report(wanted, KEPT.stored, world_runs.price)
        return
    world_runs.run_parts(chosen, workers=workers)
    if publish:
        click.echo(f"{world_published.extend(world_runs.whole(chosen))}: published")
        _say()


def _say() -> None:
    """Each question's answer, and whether it was expected."""
    from nmpcrl.claims import world, world_published
    from nmpcrl.claims.population_questions import WORDS
    from nmpcrl.claims.world_questions import WORLD_QUESTIONS

    for answer in world.answers(world_published.load().table):
        by_parts.say_counts(answer.question, answer.words, answer.counts)
        expected = WORLD_QUESTIONS[answer.question].expected
        if expected != answer.outcome:
            click.echo(f"  expected: {WORDS.get(expected, str(expected))}")
