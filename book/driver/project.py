"""What every room of the driver needs: where the project is, how it fails, and its environment."""

import os
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import click

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = {  # of a command and of the kernels that it starts, set before NumPy is imported
    **dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
    "PYDEVD_DISABLE_FILE_VALIDATION": "1",
    "NO_COLOR": "1",
    "NMPCRL_STRICT": "1",  # a solution that its check refuses ends the build
    "NMPCRL_FIGURES_FOR_PAGE": "1",  # narrow, too, for telephones: `pictures`
}


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
    """A path from the root of the project."""
    return os.path.relpath(path, ROOT)
