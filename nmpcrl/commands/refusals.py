"""A group of commands whose known errors end in one sentence, without a traceback."""

import errno
from typing import Any

import click

INSTEAD = {  # of commands that earlier versions had
    "agents": "use `nmpcrl investigate agents`",
    "clean": "delete files in the folder of the runs yourself",
    "compare": "read two runs with `nmpcrl.study.fetch` and compare their tables",
    "completion": "click writes the script: `_NMPCRL_COMPLETE=bash_source nmpcrl`",
    "evaluate": "use `nmpcrl show`",
    "remedies": "use `nmpcrl investigate remedies`",
    "study": "use `nmpcrl investigate main_study`",
    "world": "use `nmpcrl investigate worlds`",
}


class Commands(click.Group):
    """Commands whose known errors end in one sentence."""

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command; a name of `INSTEAD` is refused with what to use instead."""
        if cmd_name in INSTEAD:
            ctx.fail(f"there is no {cmd_name!r} any more: {INSTEAD[cmd_name]}.")
        return super().get_command(ctx, cmd_name)

    def invoke(self, ctx: click.Context) -> Any:
        """Call the command; a known error becomes its sentence and exit code 1."""
        try:
            return super().invoke(ctx)
        except Exception as error:
            if message := sentence(error):
                raise click.ClickException(message) from None
            raise


def sentence(error: Exception) -> str:
    """The message for the user; empty if the error is a mistake of the library."""
    from nmpcrl.study.refusal import Refusal

    if isinstance(error, Refusal):
        return str(error)
    if isinstance(error, OSError) and error.errno != errno.EPIPE:
        reason = error.strerror or str(error) or type(error).__name__
        return f"{error.filename}: {reason}" if error.filename else reason
    if isinstance(error, MemoryError):
        return str(error) or "this machine has too little memory"
    return ""
