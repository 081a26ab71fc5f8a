"""Points of what students hand in: each notebook in a process of its own, with limits.

This is no sandbox. A notebook runs with the rights of whoever grades, and can read their files.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from nmpcrl.course import confined
from nmpcrl.course.confined import End, Limits, Sat
from nmpcrl.course.exercises import Exercise
from nmpcrl.course.submissions import (
    CannotGrade,
    Chapter,
    Step,
    Submission,
    chapters,
    notebook_of,
    taken,
)

BY_HAND = "A project: read it with its rubric."
SAID = ("Unsolved", "Refusal", "ParameterError")  # errors whose message is a sentence


@dataclass(frozen=True)
class Mark:
    """The points of a student for an exercise."""

    student: str
    notebook: str  # the file, from the folder of all
    exercise: str  # its number; empty if the notebook could not be read
    points: int | None  # None: a person gives them
    of: int
    why: str = ""  # points were lost


def grade(folder: Path, edition: Path, limits: Limits) -> Iterator[Mark]:
    """Marks of every notebook below a folder, in the order of their paths.

    Args:
        folder: of a folder for each student, or of notebooks whose names end in the chapter's.
        edition: the folder that `make course` writes for graders.
        limits: of each notebook.

    Raises:
        CannotGrade: a folder is not there, or holds no notebook.
    """
    known = chapters(edition)
    paths = [p for p in sorted(folder.rglob("*.ipynb")) if ".ipynb_checkpoints" not in p.parts]
    if not paths:
        raise CannotGrade(f"{folder} has no notebook")
    for path in paths:
        yield from _marks(path, path.relative_to(folder), known, limits)


def _marks(path: Path, file: Path, known: list[Chapter], limits: Limits) -> Iterator[Mark]:
    """The marks of one notebook, or why it has none."""
    chapter = next((one for one in known if file.stem.endswith(one.name)), None)
    if chapter is None:
        why = "The name of the file does not end in that of a chapter."
        yield Mark(_student(file, file.stem), file.as_posix(), "", None, 0, why)
        return
    student = _student(file, file.stem.removesuffix(chapter.name).rstrip("_- ") or file.stem)
    try:
        submission = taken(chapter, notebook_of(path))
    except (CannotGrade, OSError) as error:
        losses = {one.name: str(error) for one in chapter.exercises}
    else:
        losses = judged(chapter, submission, limits)
    for one in chapter.exercises:
        why, points = losses[one.name], one.about.points
        got = None if not one.parts["check"] else 0 if why else points
        yield Mark(student, file.as_posix(), one.number, got, points, why)


def _student(file: Path, alone: str) -> str:
    """The folder of a student; what is left of the file's name where there is none."""
    return file.parts[0] if len(file.parts) > 1 else alone


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
            return said if kind in SAID else f"The check fails with {kind}: {_line(said)}"
        if not end["right"]:
            return "The check gives something else than an outcome."
    return ""


def _line(message: str) -> str:
    """The first line of a message."""
    return message.strip().partition("\n")[0] or "no message"
