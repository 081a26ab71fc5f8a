"""Points of what students hand in: each notebook in a process of its own, with limits.

This is no sandbox. A notebook runs with the rights of whoever grades, and can read their files.
"""

import re
import tempfile
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from nmpcrl.course import confined
from nmpcrl.course.confined import Limits
from nmpcrl.course.judging import judged
from nmpcrl.course.submissions import CannotGrade, Chapter, chapters, notebook_of, taken

COPY = re.compile(r"(-Copy\d+| ?\(\d+\))$")


@dataclass(frozen=True)
class Mark:
    """The points of a student for an exercise."""

    student: str
    notebook: str  # the file, from the folder of all
    exercise: str  # its number; empty if the notebook could not be read
    points: int | None  # None: a person gives them
    of: int
    why: str = ""  # points were lost


def grade(folder: Path, edition: Path, limits: Limits, workers: int = 1) -> Iterator[list[Mark]]:
    """Marks of every notebook below a folder, in the order of their paths.

    Args:
        folder: of a folder for each student, or of notebooks whose names end in the chapter's.
        edition: the folder that `make course` writes for graders.
        limits: of each notebook.
        workers: how many notebooks are executed at a time.

    Raises:
        CannotGrade: a folder is not there, or holds no notebook; nothing has been executed.
    """
    known = chapters(edition)
    paths = [p for p in sorted(folder.rglob("*.ipynb")) if ".ipynb_checkpoints" not in p.parts]
    if not paths:
        raise CannotGrade(f"{folder} has no notebook")
    of = {path: next((c for c in known if _stem(path).endswith(c.name)), None) for path in paths}
    return _graded(folder, of, limits, workers)


def _graded(
    folder: Path, of: Mapping[Path, Chapter | None], limits: Limits, workers: int
) -> Iterator[list[Mark]]:
    """The marks of each notebook."""
    asked = {chapter for chapter in of.values() if chapter}
    with tempfile.TemporaryDirectory() as place, ThreadPoolExecutor(workers) as threads:
        ready = dict(
            zip(
                asked,
                threads.map(lambda c: rehearsed(c, limits, Path(place) / c.name), asked),
                strict=True,
            )
        )

        def marks(path: Path, chapter: Chapter | None) -> list[Mark]:
            return list(_marks(path, path.relative_to(folder), chapter and ready[chapter], limits))

        yield from threads.map(marks, of.keys(), of.values())


def _stem(file: Path) -> str:
    """The name of a notebook, without what a browser or JupyterLab adds to that of a copy."""
    return COPY.sub("", file.stem)


def rehearsed(chapter: Chapter, limits: Limits, place: Path) -> Chapter:
    """The chapter with data that hold what it trains, so that no notebook trains that again.

    Args:
        chapter: of an edition for graders.
        limits: as for a notebook that is handed in.
        place: a new folder for the data.

    Raises:
        CannotGrade: it fails, or does not reach its end, although nobody has answered anything.
    """
    steps = taken(chapter, chapter.notebook).steps
    until = time.monotonic() + limits.seconds
    sat = confined.run(chapter, steps, limits, until, kept=place)
    for step in steps:
        if step.name not in sat.ends:
            raise CannotGrade(f"{chapter.name} itself was stopped on this computer: {sat.why}")
        if (error := sat.ends[step.name]["error"]) and not step.group:
            raise CannotGrade(f"{chapter.name} itself fails with {error[0]}: {error[1]}")
    return replace(chapter, data=place if place.is_dir() else None)


def _marks(path: Path, file: Path, chapter: Chapter | None, limits: Limits) -> Iterator[Mark]:
    """The marks of one notebook, or why it has none."""
    if chapter is None:
        why = "The name of the file does not end in that of a chapter."
        yield Mark(_student(file, file.stem), file.as_posix(), "", None, 0, why)
        return
    stem = _stem(file)
    student = _student(file, stem.removesuffix(chapter.name).rstrip("_- ") or stem)
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
