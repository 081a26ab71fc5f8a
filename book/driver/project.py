"""The project on this disk, the pages of its book, and how a command of the driver fails."""

import os
import sys
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import click
import yaml

ROOT = Path(__file__).resolve().parents[2]


class Failure(click.ClickException):
    """A sentence for the reader; the details are in a log."""

    def show(self, file: IO[Any] | None = None) -> None:
        click.echo(self.message, file=sys.stderr)


@contextmanager
def reported(log: Path) -> Iterator[None]:
    """Turn an error that no step foresaw into a sentence and a log."""
    try:
        yield
    except Failure:
        raise
    except Exception as error:
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text(traceback.format_exc())
        raise Failure(
            f"The build failed with {type(error).__name__}: {error} (all of it: {shown(log)})"
        ) from error


def shown(path: Path) -> str:
    return os.path.relpath(path, ROOT)


def from_yaml(name: str) -> Any:
    """A file of the project in YAML, or in JSON."""
    return yaml.safe_load((ROOT / name).read_text("utf-8"))


def pages() -> list[str]:
    """The pages of _toc.yml in their order, without suffix."""
    toc = from_yaml("_toc.yml")
    return [toc["root"], *(page["file"] for part in toc["parts"] for page in part["chapters"])]


def notebooks() -> dict[str, Path]:
    """The pages that are notebooks: name -> path from the root."""
    paths = [Path(f"{page}.ipynb") for page in pages()]
    return {path.stem: path for path in paths if (ROOT / path).exists()}


def listed(words: Iterable[str]) -> str:
    """Words as a list in a sentence."""
    *most, last = list(words) or [""]
    return f"{', '.join(most)} and {last}" if most else last
