"""Cells of one notebook, executed in this process, which the grader has started and asks.

    python -m nmpcrl.course.cells HEARS SAYS MEGABYTES SECONDS

HEARS and SAYS are the numbers of open pipes; SECONDS of processor time are for all cells, 0 for no
limit. One such process executes what a student handed in; another one, which executes the chapter
alone, makes the checks, and asks the first one for answers and for what its functions give.
"""

import ast
import builtins
import ctypes
import os
import resource
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from IPython.core.interactiveshell import InteractiveShell

from nmpcrl.course.outcome import Outcome, Unsolved
from nmpcrl.course.peer import Message, Peer, error_of
from nmpcrl.course.plain import NotPlain, decoded

NO_MEMORY = 77  # the code with which a process ends where a student's cell takes too much
ADOPTS = 36  # PR_SET_CHILD_SUBREAPER of Linux
FILE = 200_000_000  # bytes of the largest file that a notebook may write

Names = dict[str, Any]


def confine(megabytes: int, seconds: int) -> None:
    """Set the limits of this process: data in memory, processor time, and sizes of files."""
    limits = {
        resource.RLIMIT_DATA: megabytes * 1_000_000,
        resource.RLIMIT_CPU: seconds or resource.RLIM_INFINITY,
        resource.RLIMIT_FSIZE: FILE,
        resource.RLIMIT_CORE: 0,
    }
    for limit, value in limits.items():
        hard = resource.getrlimit(limit)[1]
        within = hard if resource.RLIM_INFINITY in (value, hard) else min(value, hard)
        resource.setrlimit(limit, (within, hard))


def adopt() -> None:
    """Let this process be the parent of what leaves those below it, so that it is found there."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(ADOPTS, 1, 0, 0, 0)


class Shell(InteractiveShell):
    """A shell without a screen, in which a magic that cannot be done is left undone."""

    def enable_gui(self, gui: str | None = None) -> None:
        """There is none."""

    def run_line_magic(self, magic_name: str, line: str, _stack_depth: int = 1) -> Any:
        """What the magic gives, or nothing: `%matplotlib widget` costs no answer its points."""
        shell: Any = super()
        try:
            return shell.run_line_magic(magic_name, line, _stack_depth + 1)
        except MemoryError:
            raise
        except Exception:
            return None

    def run_cell_magic(self, magic_name: str, line: str, cell: str) -> Any:
        """What the magic makes of the cell, or the cell without it where it is not known."""
        shell: Any = super()
        if shell.find_cell_magic(magic_name) is None:
            return shell.run_cell(cell).raise_error()
        return shell.run_cell_magic(magic_name, line, cell)


class Cells:
    """A notebook that is executed, cell by cell."""

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        shell: Any = Shell.instance()
        shell.history_manager.enabled = False
        self._shell = shell
        self._home = Path.cwd()
        self._names: Names = self._shell.user_ns
        self._ours = dict(self._names)  # as the chapter last bound them

    def run(self, code: str, *, theirs: bool, asked: list[str]) -> Message:
        """Execute a cell: its error, and if a student gave a name of ours another meaning."""
        before = dict(self._names)
        done = self._shell.run_cell(code, store_history=False)
        error = done.error_before_exec or done.error_in_exec
        if theirs and isinstance(error, MemoryError):
            os._exit(NO_MEMORY)  # what it took would be missing in other cells
        if not theirs:
            names = self._names.items()
            self._ours |= {name: v for name, v in names if before.get(name, before) is not v}
        rebound = bool(theirs and self._rebound() - set(asked))
        return {"kind": "done", "error": error and error_of(error), "rebound": rebound}

    def restore(self, asked: list[str]) -> Message:
        """Give names of the chapter and of Python their meaning again; those of answers stay."""
        for name in self._rebound() - set(asked):
            if name in self._ours:
                self._names[name] = self._ours[name]
            else:
                del self._names[name]
        os.chdir(self._home)
        return {"kind": "restored"}

    def _rebound(self) -> set[str]:
        """Names that mean something else now; `_` and the like may."""
        ours = self._ours.items()
        changed = {name for name, value in ours if self._names.get(name, self._names) is not value}
        hidden = (vars(builtins).keys() & self._names.keys()) - self._ours.keys()
        return {name for name in changed | hidden if not name.startswith("_")}

    def take(self, names: list[str]) -> Message:
        """The values of names, as far as there are such."""
        self._peer.forget()
        found: dict[str, Any] = {}
        for name in self._names.keys() & set(names):
            try:
                found[name] = self._peer.given(self._names[name])
            except MemoryError:
                raise
            except Exception as error:
                found[name] = ["refused", f"It cannot be checked: {error_of(error)[1]}."]
        return {"kind": "values", "values": found}

    def check(self, code: str, values: dict[str, Any], asked: list[str]) -> Message:
        """Why an answer is not right, as the check says that the code calls; empty if it is."""
        self._peer.forget()
        names = {name: value for name, value in self._names.items() if name not in asked}
        try:
            for name, data in values.items():
                names[name] = self._answer(data)
            outcome = _value(code, names)
        except (Unsolved, NotPlain) as unsolved:
            why = str(unsolved)
        except Exception as error:
            why = "The check fails with {}: {}".format(*error_of(error))
        else:
            known = isinstance(outcome, Outcome)
            why = "" if known and outcome.right else getattr(outcome, "said", "It says nothing.")
        return {"kind": "outcome", "why": why}

    def _answer(self, data: Any) -> Any:
        if data[0] == "refused":
            raise NotPlain(str(data[1]))
        return decoded(data, self._peer.function)


def _value(code: str, names: Names) -> Any:
    """The value of the last line of a code."""
    *before, last = ast.parse(code).body
    exec(compile(ast.Module(before, []), "<check>", "exec"), names)
    if not isinstance(last, ast.Expr):
        raise TypeError("its last line is no value")
    return eval(compile(ast.Expression(last.value), "<check>", "eval"), names)


def main(*numbers: str) -> None:
    """Answer what the grader asks, and end with it, not waiting for what a cell left running."""
    hears, says, megabytes, seconds = map(int, numbers)
    confine(megabytes, seconds)
    adopt()
    peer = Peer(hears, says)
    cells = Cells(peer)
    answers: dict[str, Callable[..., Message]] = {
        "run": cells.run,
        "restore": cells.restore,
        "take": cells.take,
        "check": cells.check,
    }
    while True:
        try:
            asked = peer.hear()
            kind = asked.pop("kind")
            peer.say(peer.called(asked) if kind == "call" else answers[kind](**asked))
        except MemoryError:
            os._exit(NO_MEMORY)
        except (EOFError, OSError):
            os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
