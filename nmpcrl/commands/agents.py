"""`nmpcrl agents`: tune, judge and publish SAC and TD3 on the robot's task."""

from typing import Any

import click

from nmpcrl.commands import by_parts


@click.command()
@by_parts.options("tune or judge")
def agents(parts: tuple[str, ...], **asked: Any) -> None:
    """Train SAC and TD3, which know nothing of an NMPC.

    What is asked, and how, was fixed before. The parts are tune, judge, one
    and all, in this order. Each run is stored, so it can be interrupted and
    started again. It needs the extra nmpcrl[agents].

    \b
    Example:
      nmpcrl agents --part tune
      nmpcrl agents --dry-run
    """
    from nmpcrl.analysis.agent_curves import KEPT
    from nmpcrl.claims import agent_published, agent_runs

    runs = by_parts.Runs(
        order=agent_runs.ORDER,
        planned=agent_runs.planned,
        stored=KEPT.stored,
        price=agent_runs.price,
        run=agent_runs.run_parts,
        extend=lambda chosen: agent_published.extend(agent_runs.whole(chosen)),
        say=_say,
    )
    by_parts.carry_out(runs, parts, **asked)


def _say() -> None:
    """Each question's answer, and whether it was expected."""
    from nmpcrl.claims import agent_published, agents, remedy_published
    from nmpcrl.claims.agent_questions import AGENT_QUESTIONS

    table, suite = agent_published.load().table, remedy_published.load_if_there()
    for row in agents.rows(table, suite) if suite is not None else ():
        click.echo(f"{row.name}: {row.gain:.2f} of the possible gain, {row.solved:.0%} solved")
    by_parts.say_answers(agents.answers(table, suite), AGENT_QUESTIONS)
