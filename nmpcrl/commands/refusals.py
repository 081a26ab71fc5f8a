"""What a command cannot do ends in one sentence, and never in a traceback."""

import errno
import sys
from typing import Any

import click

SAID = (  # errors whose message is a sentence for the reader, and where they are defined
    ("nmpcrl.study.storage.refusal", "Refusal"),
    ("nmpcrl.study.records", "DamagedRecords"),
    ("nmpcrl.study.storage.place", "StoreError"),
    ("nmpcrl.study.jobs", "Failed"),
    ("nmpcrl.study.cluster", "NoCluster"),
    ("nmpcrl.bench.sweep", "DamagedSweep"),
    ("nmpcrl.analysis.summaries", "Failed"),
    ("nmpcrl.analysis.summaries", "OtherSolver"),
    ("nmpcrl.claims.published", "Damaged"),
    ("nmpcrl.claims.reproduce", "CannotRelock"),
)


class Commands(click.Group):
    """A group of commands, in the order in which they were added."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Not sorted by name: the first is what a reader needs first."""
        return list(self.commands)

    def invoke(self, ctx: click.Context) -> Any:
        """Call a command; an error that is known becomes its sentence and exit code 1."""
        try:
            return super().invoke(ctx)
        except Exception as error:
            said = error.message if isinstance(error, click.ClickException) else sentence(error)
            if said is None:
                raise
            from nmpcrl.study.storage.place import harmless

            if isinstance(error, click.ClickException):
                vars(error)["message"] = harmless(said)  # which click declares final
                raise
            raise click.ClickException(harmless(said)) from None


def sentence(error: Exception) -> str | None:
    """What an error says to the reader; nothing of one that is a mistake of ours.

    A module that was never imported raised nothing, so none is imported for this.
    """
    known = [getattr(sys.modules.get(module), name, ()) for module, name in SAID]
    if isinstance(error, tuple(one for one in known if one)):
        return str(error)
    if isinstance(error, OSError) and error.errno != errno.EPIPE:
        reason = error.strerror or str(error) or type(error).__name__
        return f"{error.filename}: {reason}" if error.filename else reason
    if isinstance(error, MemoryError):
        return str(error) or "this machine does not have enough memory for this"
    return None
