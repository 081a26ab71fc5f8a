"""The result or the error of a job, as bytes that any executor can send.

A worker pickles it itself. An executor that cannot send a result, such as an error a thousand calls
deep on Dask, may never return it, and its caller would wait without end.
"""

import pickle
import traceback
from collections.abc import Callable
from typing import Any


class Unsendable(RuntimeError):
    """What a job returned or raised cannot be pickled; the message says what it was."""


class Elsewhere(Exception):
    """The traceback of a worker, as text: it is the cause of what is raised here."""

    def __str__(self) -> str:
        return f"\n{self.args[0]}"


def pack(job: Callable[[], Any]) -> bytes:
    """What a worker does: the job, and what it returns or raises, pickled."""
    try:
        return _pickled(job(), None)
    except Exception as error:
        said = "".join(traceback.format_exception(error))
        error.__traceback__ = error.__cause__ = error.__context__ = None
        try:
            return _pickled(error, said)
        except Unsendable as other:
            return _pickled(other, said)


def unpack(packed: bytes) -> Any:
    """What the job returned.

    Raises:
        Exception: what the job raised.
    """
    made, said = pickle.loads(packed)
    if said is not None:
        raise made from Elsewhere(said)
    return made


def _pickled(made: Any, said: str | None) -> bytes:
    """The two in bytes that can be read again."""
    try:
        packed = pickle.dumps((made, said))
        if said is not None:
            pickle.loads(packed)  # not every error can be made again
        return packed
    except Exception as error:
        what = f"{type(made).__name__}: {made}" if said else f"a {type(made).__name__}"
        raise Unsendable(f"{what}, which cannot be sent: {type(error).__name__}") from None
