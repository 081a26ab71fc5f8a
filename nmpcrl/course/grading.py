"""Points of what students hand in: each notebook in a process of its own, with limits.

This is no sandbox. A notebook runs with the rights of whoever grades, and can read their files.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from nmpcrl.course import confined
from nmpcrl.course.confined import Limits, Sat
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

    A cell that has to be stopped is taken out, and all others run again without it.
    """
    remarks = dict(submission.remarks)
    steps = submission.steps
    for _ in range(len(chapter.exercises) + 1):
        sat = confined.run([(step.name, step.code) for step in steps], chapter.data, limits)
        at = next((step for step in steps if step.name == sat.stopped), None)
        if at is None or not (at.theirs or at.exercise):
            break
        if at.exercise:
            remarks[at.exercise] = f"The notebook was stopped in this exercise: {sat.why}."
        steps = _without(steps, at, chapter)
    return {one.name: _loss(one, remarks.get(one.name, ""), sat) for one in chapter.exercises}


def _without(steps: list[Step], at: Step, chapter: Chapter) -> list[Step]:
    """The cells without one that was stopped; of an exercise, without its answers, too."""
    given = {cell.id: cell.source for one in chapter.exercises for cell in one.parts["answer"]}
    kept = [step for step in steps if step is not at]
    if at.theirs or not at.exercise:
        return kept
    return [
        replace(step, code=given.get(step.name, step.code))
        for step in kept
        if step.exercise != at.exercise or step.name in given
    ]


def _loss(one: Exercise, remark: str, sat: Sat) -> str:
    """Why an exercise gets no points, if it gets none."""
    if not one.parts["check"]:
        return BY_HAND
    if remark:
        return remark
    for cell in one.parts["answer"]:
        error = sat.ends.get(cell.id, {}).get("error")
        if error and error[0] not in SAID:
            return f"The answer fails with {error[0]}: {_line(error[1])}"
    for cell in one.parts["check"]:
        end = sat.ends.get(cell.id)
        if end is None:
            return f"The notebook was stopped before this exercise: {sat.why}."
        if end["error"]:
            kind, said = end["error"]
            return said if kind in SAID else f"The check fails with {kind}: {_line(said)}"
        if not end["right"]:
            return "The check gives something else than an outcome."
    return ""


def _line(message: str) -> str:
    """The first line of a message."""
    return message.strip().partition("\n")[0] or "no message"
