"""The process that makes the checks of a chapter; no code of a student enters it.

It has executed the chapter, so a check finds what that computed. The process of a notebook gives it
plain values, and what functions answer; see `plain`.
"""

import contextlib
import shutil
import threading
import time
from dataclasses import replace
from pathlib import Path

from nmpcrl.course import execution
from nmpcrl.course.execution import Limits, Process, Stopped
from nmpcrl.course.peer import Message
from nmpcrl.course.submissions import CannotGrade, Chapter, Step, matched

TALK = ("call", "value", "error")  # kinds of messages that a check and a notebook exchange
LONGEST = 1000  # letters of a sentence: what a student's object calls itself may have more


class Judge:
    """The process that makes the checks of a chapter, for one notebook at a time."""

    def __init__(self, chapter: Chapter, limits: Limits, place: Path) -> None:
        """Execute the chapter.

        Args:
            chapter: of an edition for graders.
            limits: as for a notebook that is handed in.
            place: a new folder for its data and what it trains, so that no notebook trains again.

        Raises:
            CannotGrade: it fails, or does not reach its end, although nobody answered anything.
        """
        self._given, self._limits, self._place = chapter, limits, place
        self._one_at_a_time = threading.Lock()
        self._closing = contextlib.ExitStack()
        self._process = self._begun()

    def _begun(self) -> Process:
        """The process, once it has executed the chapter."""
        try:
            return self._rehearsed()
        except BaseException:
            self.close()
            raise

    def _rehearsed(self) -> Process:
        chapter, limits = self._given, self._limits
        until = time.monotonic() + limits.seconds
        opened = execution.process(chapter.data, limits, until, trusted=True)
        process = self._closing.enter_context(opened)
        for step in matched(chapter, chapter.notebook).steps:
            try:
                error = "" if step.check else executed(process, step, chapter, limits)[0]
            except Stopped as stopped:
                why = f"{chapter.name} itself was stopped on this computer: {stopped}"
                raise CannotGrade(why) from None
            if error and not step.group:
                raise CannotGrade(f"{chapter.name} itself fails with {error}")
        if (process.work / "data").is_dir() and not self._place.exists():
            shutil.copytree(process.work / "data", self._place, symlinks=True)
        process.until = float("inf")
        return process

    @property
    def chapter(self) -> Chapter:
        """The chapter with data that hold what it trains."""
        return replace(self._given, data=self._place if self._place.is_dir() else None)

    def loss(self, step: Step, notebook: Process) -> str:
        """Why the answers of a notebook lose the points of a check; empty if they do not.

        Raises:
            Stopped: the notebook was, or the check takes more than a notebook may.
        """
        until = time.monotonic() + self._limits.cell
        take = {"kind": "take", "names": list(step.answers)}
        values = notebook.ask(take, "values", until=until)["values"]
        asked = sorted(self._given.asked)
        check = {"kind": "check", "code": step.code, "values": values, "asked": asked}
        waits = time.monotonic()
        with self._one_at_a_time:
            waited = time.monotonic() - waits
            notebook.until += waited
            return self._conversation(check, notebook, until + waited)

    def _conversation(self, message: Message, notebook: Process, until: float) -> str:
        """Pass on what the check and the notebook ask each other, until there is an outcome."""
        stopped = None
        try:
            while True:
                late = time.monotonic() + self._limits.cell
                heard = self._process.ask(message, "outcome", *TALK, until=late)
                if heard["kind"] == "outcome":
                    break
                try:
                    message = notebook.ask(heard, *TALK, until=until)
                except Stopped as error:
                    stopped, until = error, 0
                    message = {"kind": "error", "error": ["Stopped", str(error)]}
        except Stopped as error:
            self.close()
            self._process = self._begun()
            raise Stopped(f"its check: {error}") from None
        if stopped:
            raise stopped
        return heard["why"] and line(heard["why"])

    def close(self) -> None:
        """End the process."""
        self._closing.close()


def executed(process: Process, step: Step, chapter: Chapter, limits: Limits) -> tuple[str, bool]:
    """The error of a cell, if there is one, and whether it gave a name another meaning."""
    until = time.monotonic() + limits.cell if step.group else float("inf")
    about = {"code": step.code, "theirs": step.theirs, "asked": sorted(chapter.asked)}
    done = process.ask({"kind": "run"} | about, "done", until=until)
    error = done.get("error")
    return ": ".join(map(str, error)) if error else "", bool(done.get("rebound"))


def line(message: str) -> str:
    """The first line of a message, or what a table has room for of it."""
    return message.strip().partition("\n")[0][:LONGEST] or "no message"
