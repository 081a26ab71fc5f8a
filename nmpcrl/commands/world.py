"""`nmpcrl world`: run, publish and judge worlds that move, change, or are not the model."""

from typing import Any

import click

from nmpcrl.commands import by_parts


@click.command()
@by_parts.options("moving")
def world(parts: tuple[str, ...], **asked: Any) -> None:
    """Learn where obstacles move or the model is wrong.

    Or where layouts change between episodes, or the terminal cost is
    richer. What is asked, and how, was fixed before. The parts are moving,
    model, once, "every 50", random, carry, gradient and terminal, in this
    order. Each run is stored, so it can be
    interrupted and started again.

    \b
    Example:
      nmpcrl world --part moving
      nmpcrl world --dry-run
    """
    from nmpcrl.analysis.worlds import KEPT
    from nmpcrl.claims import world_published, world_runs

    runs = by_parts.Runs(
        order=world_runs.ORDER,
        planned=world_runs.planned,
        stored=KEPT.stored,
        price=world_runs.price,
        run=world_runs.run_parts,
        extend=lambda chosen: world_published.extend(world_runs.whole(chosen)),
        say=_say,
    )
    by_parts.carry_out(runs, parts, **asked)


def _say() -> None:
    """Each question's answer, and whether it was expected."""
    from nmpcrl.claims import world, world_published

    by_parts.say_answers(world.answers(world_published.load().table), world.QUESTIONS)
