"""Files that a command is to write: looked at before any work, not after it."""

import tempfile
from pathlib import Path
from typing import Any

import click


def refuse_unwritable(folder: Path) -> None:
    """Refuse a folder that takes no file, or that cannot be made.

    Raises:
        click.ClickException: it is so; the message names the place.
    """
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    try:
        with tempfile.TemporaryFile(dir=there):
            return
    except OSError as error:
        raise click.ClickException(f"{there} cannot be written: {error.strerror}") from None


class Place(click.Path):
    """A path, as a Path: of a file or folder that may be asked to be there."""

    def __init__(self, **asked: Any) -> None:
        """As `click.Path`."""
        super().__init__(path_type=Path, **asked)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """The path; what no path can be, such as an empty one, is refused."""
        if not str(value):
            self.fail("'' is not a path: it has no name.", param, ctx)
        try:
            return Path(str(super().convert(value, param, ctx)))
        except ValueError as error:  # a null character
            self.fail(f"{str(value)!r} is not a path: {error}.", param, ctx)


class NewFile(Place):
    """A file that can be written: its folder is there, and takes files."""

    def __init__(self) -> None:
        """A file, not a folder."""
        super().__init__(dir_okay=False, writable=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """The path, once a file beside it could be made."""
        path = super().convert(value, param, ctx)
        try:
            with tempfile.TemporaryFile(dir=path.parent):
                return path
        except OSError as error:
            self.fail(f"{str(value)!r} cannot be written: {error.strerror}.", param, ctx)
        except ValueError as error:
            self.fail(f"{str(value)!r} is not a path: {error}.", param, ctx)
