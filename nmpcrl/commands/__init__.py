"""The command `nmpcrl`, a module a command; a command imports the library when it is called."""

import os
from pathlib import Path

import click

from nmpcrl import __version__
from nmpcrl.commands.bench import bench
from nmpcrl.commands.grade import grade
from nmpcrl.commands.investigate import investigate
from nmpcrl.commands.refusals import Commands
from nmpcrl.commands.runs import runs
from nmpcrl.commands.show import show
from nmpcrl.commands.suite import suite
from nmpcrl.commands.train import train
from nmpcrl.commands.verify import verify
from nmpcrl.commands.wasm import wasm

__all__ = ["main"]


@click.group(
    cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "show_default": True}
)
@click.version_option(__version__, message="nmpcrl %(version)s")
def main() -> None:
    """Reinforcement learning on top of nonlinear MPC: one paper, reproduced.

    \b
    Example:
      nmpcrl train --learner GES --episodes 20
      nmpcrl runs --sort cost
      nmpcrl show GES
    """
    os.environ["MPLBACKEND"] = "agg"  # no command opens a window
    if Path(runs := os.environ.get("NMPCRL_RUNS", "")).is_file():
        raise click.ClickException(f"NMPCRL_RUNS = {runs!r} must be a folder")


for command in (train, runs, show, investigate, verify, bench, suite, grade, wasm):
    main.add_command(command)
