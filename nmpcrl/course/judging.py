"""Which exercises of a notebook are solved: the others with a sentence, whatever a cell does."""

import time
from dataclasses import replace

from nmpcrl.course import confined
from nmpcrl.course.confined import End, Limits, Sat
from nmpcrl.course.exercises import Exercise
from nmpcrl.course.submissions import Chapter, Step, Submission

BY_HAND = "A project: read it with its rubric."
LONGEST = 1000  # letters of a sentence: what a student's object calls itself may have more
SAID = ("Unsolved", "Refusal", "ParameterError")  # errors whose message is a sentence


def judged(chapter: Chapter, submission: Submission, limits: Limits) -> dict[str, str]:
    """Why the points of an exercise are lost, by its name; empty where they are not.

    Where a student gave a name of the chapter another meaning, it is all executed once more with
    the old meanings put back after each exercise, and the better of both counts.
    """
    until = time.monotonic() + limits.seconds
    losses, rebound = _losses(chapter, submission, limits, until)
    if rebound and any(losses[one.name] for one in chapter.exercises if one.parts["check"]):
        again, _ = _losses(chapter, submission, limits, until, restored=True)
        losses = {name: why and again[name] and why for name, why in losses.items()}
    return losses


def _losses(
    chapter: Chapter,
    submission: Submission,
    limits: Limits,
    until: float,
    *,
    restored: bool = False,
) -> tuple[dict[str, str], bool]:
    """Why points are lost, and whether a student gave a name of the chapter another meaning.

    Where a cell has to be stopped, its exercise is emptied, and the others run again without it.
    """
    remarks, steps = dict(submission.remarks), submission.steps
    ends: dict[str, End] = {}
    while True:
        sat = confined.run(chapter, steps, limits, until, restored=restored)
        ends |= sat.ends
        group = _guilty(steps, sat, chapter)
        if group is None or time.monotonic() > until:
            break
        remarks[group] = f"The notebook was stopped in this exercise: {sat.why}."
        steps = _without(steps, group, chapter)
    losses = {o.name: _loss(o, remarks.get(o.name, ""), ends, sat.why) for o in chapter.exercises}
    return losses, any(end["rebound"] for end in ends.values())


def _guilty(steps: list[Step], sat: Sat, chapter: Chapter) -> str | None:
    """The group of the cell that did not end, or of the last before it that a student wrote."""
    at = next((k for k, step in enumerate(steps) if step.name not in sat.ends), None)
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


def _loss(one: Exercise, remark: str, ends: dict[str, End], stopped: str) -> str:
    """Why an exercise gets no points, if it gets none."""
    if not one.parts["check"]:
        return BY_HAND
    if remark:
        return remark
    for cell in one.parts["answer"]:
        error = ends.get(cell.id, {}).get("error")
        if error and error[0] not in SAID:
            return f"The answer fails with {error[0]}: {_line(error[1])}"
    for cell in one.parts["check"]:
        end = ends.get(cell.id)
        if end is None:
            return f"The notebook was stopped before this exercise: {stopped}."
        if end["error"]:
            kind, said = end["error"]
            return _line(said) if kind in SAID else f"The check fails with {kind}: {_line(said)}"
        if not end["right"]:
            return "The check does not say that it is right."
    return ""


def _line(message: str) -> str:
    """The first line of a message, or what a table has room for of it."""
    return message.strip().partition("\n")[0][:LONGEST] or "no message"
