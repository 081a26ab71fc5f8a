"""`nmpcrl suite`: one row for any learner, tuner or policy."""

import click

from nmpcrl.commands.options import WORKERS


@click.command()
@click.option("--policy", metavar="ENTRY", help="MODULE:FACTORY, or a shipped entry, such as ES.")
@click.option("--moving", is_flag=True, help="The 40 scenarios in which obstacles move.")
@click.option("--budget", metavar="N", default=300, help="Episodes a layout.")
@click.option("--layouts", metavar="N", type=int, help="Only the first N of the 120, or 40.")
@click.option("--seeds", metavar="N", default=2, help="Seeds a layout.")
@WORKERS
@click.option("--list", "listed", is_flag=True, help="Only list the shipped entries.")
def suite(policy: str | None, moving: bool, workers: int | None, listed: bool,
          **asked: int | None) -> None:  # fmt: skip
    """Judge an entry on 120 layouts or among moving obstacles.

    An entry is a learner, a tuner or a policy, and was tuned on neither. FACTORY
    is a function of a Robot. It may begin as many of its episodes as the budget
    has, and returns theta or a policy from observations to actions. An entry
    that begins one more is disqualified.

    \b
    Example:
      nmpcrl suite --policy CMA-ES --budget 50
      nmpcrl suite --policy CMA-ES --budget 50 --moving
      nmpcrl suite --policy my_tuner:factory --layouts 10
    """
    import pandas as pd

    from nmpcrl.analysis.suite import ENTRIES, judge_all, scores

    if listed:
        click.echo("\n".join(ENTRIES))
        return
    if policy is None:
        raise click.ClickException("--policy names an entry: MODULE:FACTORY, or a shipped one")
    judged = judge_all(policy, moving=moving, workers=workers, **asked)  # type: ignore[arg-type]
    found = scores(judged)
    if found["over"]:
        said = f"it began more than {asked['budget']} episodes in {found['over']}"
        raise click.ClickException(f"{policy} is disqualified: {said}")
    cells = {
        "entry": policy,
        "scenarios" if moving else "layouts": found["places"],
        "solved": f"{found['solved']:.0%}",
        "gain": f"{found['gain']:.1%}",
        "episodes": found["episodes"],
        "CPU time": f"{found['seconds']:.0f} s",
    } | ({"never inside": f"{found['clear']:.0%}"} if moving else {})
    click.echo(pd.DataFrame([cells]).to_string(index=False))
