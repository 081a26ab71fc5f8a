"""Types of options that several commands have."""

import os
from pathlib import Path
from typing import Any

import click

WORKERS = click.option(
    "--workers",
    metavar="N",
    type=click.IntRange(1),
    callback=lambda ctx, param, count: count and min(count, os.cpu_count() or 1),
    help="Processes; by default, and at most, one per core.",
)
FOLDER = click.Path(exists=True, file_okay=False, path_type=Path)


class NewFile(click.Path):
    """A file to write, in a folder that exists and takes files."""

    def __init__(self) -> None:
        super().__init__(dir_okay=False, writable=True, path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """The path; refused before any work if no file can be written there."""
        path = Path(str(super().convert(value, param, ctx)))
        folder = path.parent
        if not value or not folder.is_dir() or not os.access(folder, os.W_OK):
            self.fail(f"{str(value)!r} cannot be written: {folder} is no folder to write to.")
        return path


def refuse_unwritable(folder: Path) -> None:
    """Make a folder.

    Raises:
        click.ClickException: files cannot be written there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise click.ClickException(f"{folder} cannot be made: {error.strerror}") from None
    if not os.access(folder, os.W_OK):
        raise click.ClickException(f"{folder} cannot be written")
