"""Which exercises of a notebook are solved: the others with a sentence, whatever a cell does.

A check runs in the process of a `Judge`, which has executed the chapter and nothing that a student
wrote. The process of the notebook gives it plain values, and what functions answer; see `plain`.
"""

import contextlib
import shutil
import threading
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

from nmpcrl.course import execution
from nmpcrl.course.execution import Limits, Process, Stopped
from nmpcrl.course.exercises import Exercise
from nmpcrl.course.peer import Message
from nmpcrl.course.submissions import CannotGrade, Chapter, Step, Submission, matched

BY_HAND = "A project: read it with its rubric."
TALK = ("call", "value", "error")  # kinds of messages that a check and a notebook exchange
LONGEST = 1000  # letters of a sentence: what a student's object calls itself may have more


@dataclass(eq=False)
class Run:
    """What became of the cells of a notebook."""

    errors: dict[str, str] = field(default_factory=dict)  # of cells that ended; empty if none
    losses: dict[str, str] = field(default_factory=dict)  # what a check says; empty: it is right
    rebound: bool = False  # a student gave a name of the chapter another meaning
    why: str = ""  # the other cells did not end

    @property
    def ended(self) -> set[str]:
        """The names of the cells that did."""
        return {*self.errors, *self.losses}


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
                error = "" if step.check else _executed(process, step, chapter, limits)[0]
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
        return heard["why"] and _line(heard["why"])

    def close(self) -> None:
        """End the process."""
        self._closing.close()


def losses(judge: Judge, submission: Submission, limits: Limits) -> dict[str, str]:
    """Why the points of an exercise are lost, by its name; empty where they are not.

    Where a student gave a name of the chapter another meaning, it is all executed once more with
    the old meanings put back after each exercise, and the better of both counts.
    """
    until = time.monotonic() + limits.seconds
    first, rebound = _losses(judge, submission, limits, until)
    if rebound and any(first[one.name] for one in judge.chapter.exercises if one.parts["check"]):
        again, _ = _losses(judge, submission, limits, until, restored=True)
        first = {name: why and again[name] and why for name, why in first.items()}
    return first


def _losses(
    judge: Judge, submission: Submission, limits: Limits, until: float, *, restored: bool = False
) -> tuple[dict[str, str], bool]:
    """Why points are lost, and whether a student gave a name of the chapter another meaning.

    Where a cell has to be stopped, its exercise is emptied, and the others run again without it.
    """
    chapter = judge.chapter
    remarks, steps, known = dict(submission.remarks), submission.steps, Run()
    while True:
        new = run(judge, steps, limits, until, restored=restored)
        rebound = known.rebound or new.rebound
        known = Run(known.errors | new.errors, known.losses | new.losses, rebound, new.why)
        group = _guilty(steps, new, chapter)
        if group is None or time.monotonic() > until:
            break
        remarks[group] = f"The notebook was stopped in this exercise: {new.why}."
        steps = _without(steps, group, chapter)
    return {o.name: _loss(o, remarks.get(o.name, ""), known) for o in chapter.exercises}, rebound


def run(
    judge: Judge, steps: list[Step], limits: Limits, until: float, *, restored: bool = False
) -> Run:
    """Execute cells in a fresh process, and let the judge check the answers between them.

    Args:
        judge: of the chapter to which they belong.
        steps: the cells.
        limits: of the notebook.
        until: when it has had its time, as `time.monotonic` counts it.
        restored: after each exercise the names of the chapter have their meaning again.
    """
    chapter, made = judge.chapter, Run()
    following = [step.group for step in steps[1:]] + [""]
    with execution.process(chapter.data, limits, until) as notebook:
        try:
            for step, group in zip(steps, following, strict=True):
                if step.check:
                    made.losses[step.name] = judge.loss(step, notebook)
                else:
                    error, rebound = _executed(notebook, step, chapter, limits)
                    made.errors[step.name] = error
                    made.rebound |= rebound
                if restored and step.group and group != step.group:
                    notebook.ask({"kind": "restore", "asked": sorted(chapter.asked)}, "restored")
        except Stopped as stopped:
            made.why = str(stopped)
    return made


def _executed(process: Process, step: Step, chapter: Chapter, limits: Limits) -> tuple[str, bool]:
    """The error of a cell, if there is one, and whether it gave a name another meaning."""
    until = time.monotonic() + limits.cell if step.group else float("inf")
    about = {"code": step.code, "theirs": step.theirs, "asked": sorted(chapter.asked)}
    done = process.ask({"kind": "run"} | about, "done", until=until)
    error = done.get("error")
    return ": ".join(map(str, error)) if error else "", bool(done.get("rebound"))


def _guilty(steps: list[Step], made: Run, chapter: Chapter) -> str | None:
    """The group of the cell that did not end, or of the last before it that a student wrote."""
    at = next((k for k, step in enumerate(steps) if step.name not in made.ended), None)
    if at is None:
        return None
    written = (s.group for s in reversed(steps[:at]) if s.theirs and not _blank(s, chapter))
    return steps[at].group or next(written, None)


def _blank(step: Step, chapter: Chapter) -> bool:
    return step.code == chapter.blanks.get(step.name)


def _without(steps: list[Step], group: str, chapter: Chapter) -> list[Step]:
    """The cells with an exercise as if it was untouched; without it where it is."""
    if all(_blank(step, chapter) for step in steps if step.group == group and step.theirs):
        return [step for step in steps if step.group != group]
    blanks = chapter.blanks
    return [
        replace(step, code=blanks[step.name]) if step.group == group and step.theirs else step
        for step in steps
        if step.group != group or not step.theirs or step.name in blanks
    ]


def _loss(one: Exercise, remark: str, made: Run) -> str:
    """Why an exercise gets no points, if it gets none."""
    if not one.parts["check"]:
        return BY_HAND
    if remark:
        return remark
    for cell in one.parts["answer"]:
        if error := made.errors.get(cell.id):
            return f"The answer fails with {_line(error)}"
    for cell in one.parts["check"]:
        if cell.id not in made.losses:
            return f"The notebook was stopped before this exercise: {made.why}."
        if why := made.losses[cell.id]:
            return why
    return ""


def _line(message: str) -> str:
    """The first line of a message, or what a table has room for of it."""
    return message.strip().partition("\n")[0][:LONGEST] or "no message"
