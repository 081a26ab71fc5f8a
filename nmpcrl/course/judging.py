"""Which exercises of a notebook are solved: the others with a sentence, whatever a cell does."""

import time
from dataclasses import dataclass, field, replace

from nmpcrl.course import execution
from nmpcrl.course.execution import Limits, Stopped
from nmpcrl.course.exercises import Exercise
from nmpcrl.course.judge import Judge, executed, line
from nmpcrl.course.submissions import Chapter, Step, Submission

BY_HAND = "A project: read it with its rubric."


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
                    error, rebound = executed(notebook, step, chapter, limits)
                    made.errors[step.name] = error
                    made.rebound |= rebound
                if restored and step.group and group != step.group:
                    notebook.ask({"kind": "restore", "asked": sorted(chapter.asked)}, "restored")
        except Stopped as stopped:
            made.why = str(stopped)
    return made


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
            return f"The answer fails with {line(error)}"
    for cell in one.parts["check"]:
        if cell.id not in made.losses:
            return f"The notebook was stopped before this exercise: {made.why}."
        if why := made.losses[cell.id]:
            return why
    return ""
