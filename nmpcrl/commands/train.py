"""`nmpcrl train`: one run; each field of an experiment is an option."""

from dataclasses import Field, fields
from functools import cache
from typing import Any

import click

from nmpcrl.commands.runs import costs_of


class Train(click.Command):
    """A command with an option a field of `Experiment`, which only this command imports."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """The options of the fields, and then the command's own."""
        return [*_options(), *super().get_params(ctx)]


@cache
def _options() -> tuple[click.Option, ...]:
    from nmpcrl.study import Experiment

    return tuple(map(_option, fields(Experiment)))


def _option(one: "Field[Any]") -> click.Option:
    """The option that sets a field: `--beta-tdc X`, or `--gated/--no-gated`."""
    name, kind, text = one.name.replace("_", "-"), type(one.default), one.metadata["help"]
    switch = kind is bool
    return click.Option(
        [one.name, f"--{name}/--no-{name}" if switch else f"--{name}"],
        type=vector if kind is tuple else kind,
        default=one.default,
        help=text if switch else f"{text.rstrip('.')}: {one.metadata['allowed'].text}.",
        metavar={str: "NAME", tuple: "NUMBERS", int: "N", float: "X"}.get(kind),
    )


def vector(value: Any) -> tuple[float, ...]:
    """Numbers between commas or blanks; the experiment checks how many."""
    if isinstance(value, tuple):
        return value
    try:
        return tuple(map(float, value.replace(",", " ").split()))
    except ValueError:
        raise click.BadParameter(f"{value!r} is not a list of numbers such as 1,1,0.05.") from None


@click.command(cls=Train)
@click.option("--yes", "-y", is_flag=True, help="Train even if it takes more than a day.")
def train(yes: bool, **values: Any) -> None:
    """Train one run and store it, or read it if it is stored.

    Each field of an experiment is an option; the defaults are the paper's.

    \b
    Example:
      nmpcrl train --learner RDES --layout B --episodes 50 --no-gated
      nmpcrl train --layout "0.5,2.2 3,0.5" --target 8,4,1.57
    """
    from tqdm import tqdm

    from nmpcrl.study import Experiment, fetch
    from nmpcrl.study.limits import afford
    from nmpcrl.study.store import RUNS

    experiment = Experiment(**values)
    path = RUNS.path_of(experiment)
    stored = path.is_file()
    if not stored:
        afford([experiment], sure=yes)
    name = experiment.learner
    with tqdm(total=experiment.episodes, unit="ep", desc=name, disable=stored) as bar:

        def on_episode(done: int, cost: float) -> None:
            bar.set_postfix_str(f"cost {cost:.0f}", refresh=False)
            bar.update(done - bar.n)

        records = fetch(experiment, on_episode=on_episode)
    click.echo(f"{experiment}: {records.facts['stopped']}\n{costs_of(records)}")
    if not path.is_file():  # the store has printed the reason
        raise SystemExit(1)
    click.echo(f"{path}\nNext: nmpcrl show {path.stem}")
