"""Two processes that say plain values to each other, and call each other's functions.

A message is a JSON object with a `kind`, behind its length in eight bytes. Whoever asks gets an
answer; before it there may come calls of functions which were among the arguments.
"""

import json
import os
from collections.abc import Callable
from typing import Any

from nmpcrl.course.plain import Functions, decoded, encoded

Message = dict[str, Any]

LONGEST = 5_000_000  # bytes of a message
SIZE = 8  # bytes of its length


def framed(message: Message) -> bytes:
    """A message as it is sent."""
    text = json.dumps(message).encode()
    return len(text).to_bytes(SIZE) + text


def error_of(error: BaseException) -> list[str]:
    """An error as data: the name of its class, and what it says."""
    try:
        said = str(error)
    except Exception:
        said = ""
    return [type(error).__name__, said[: LONGEST // 10]]


class Peer:
    """One side of the conversation, that of a process which the grader has started."""

    def __init__(self, hears: int, says: int) -> None:
        self._hears, self._says = os.fdopen(hears, "rb"), os.fdopen(says, "wb")  # open pipes
        self._process = os.getpid()
        self._functions: Functions = []  # that the other side may call

    def hear(self) -> Message:
        """The next message.

        Raises:
            EOFError: the other side has ended.
        """
        size = self._hears.read(SIZE)
        if len(size) < SIZE:
            raise EOFError
        message: Message = json.loads(self._hears.read(int.from_bytes(size)))
        return message

    def say(self, message: Message) -> None:
        """Send a message; a copy of this process, which a cell may have left, ends instead."""
        if os.getpid() != self._process:
            os._exit(0)
        self._says.write(framed(message))
        self._says.flush()

    def called(self, call: Message) -> Message:
        """The result of a function of this side, which the other one calls."""
        try:
            args, names = (decoded(call[part], self.function) for part in ("args", "names"))
            value = self._functions[call["function"]](*args, **names)
            return {"kind": "value", "value": encoded(value)}
        except MemoryError:
            raise
        except BaseException as error:  # SystemExit, too
            return {"kind": "error", "error": error_of(error)}

    def given(self, value: Any) -> Any:
        """A value as data, of which the other side may call the functions."""
        return encoded(value, self._functions)

    def function(self, number: int) -> Callable[..., Any]:
        """A function of the other side."""

        def call(*args: Any, **names: Any) -> Any:
            parts = {"args": self.given(args), "names": self.given(names)}
            self.say({"kind": "call", "function": number} | parts)
            while (heard := self.hear())["kind"] == "call":
                self.say(self.called(heard))
            if heard["kind"] == "error":
                kind, said = heard["error"]
                name = kind if kind.isidentifier() else "Exception"
                raise type(name, (Exception,), {})(said)
            return decoded(heard["value"])

        return call

    def forget(self) -> None:
        """Let the other side call none of the functions any more that it was given."""
        self._functions.clear()
