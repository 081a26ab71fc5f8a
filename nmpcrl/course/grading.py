"""Points of what students hand in: each notebook in a process of its own, with limits.

The checks run in another process, so no notebook can change what they say. This is no sandbox all
the same: a notebook runs with the rights of whoever grades, reads their files, and could reach
their processes.
"""

import re
import tempfile
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from nmpcrl.course.execution import Limits
from nmpcrl.course.judge import Judge
from nmpcrl.course.judging import losses
from nmpcrl.course.submissions import CannotGrade, Chapter, chapters, matched, notebook_of

COPY = re.compile(r"(-Copy\d+| ?\(\d+\)| -? ?copy(?: \d+)?)+$", re.IGNORECASE)


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
    """Marks of every notebook below a folder, chapter by chapter, in the order of their paths.

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
    strangers = [path for path, chapter in of.items() if chapter is None]
    yield from ([_unknown(path.relative_to(folder))] for path in strangers)
    with ThreadPoolExecutor(workers) as threads:
        for chapter in dict.fromkeys(chapter for chapter in of.values() if chapter):
            paths = [path for path, its in of.items() if its is chapter]
            with (
                tempfile.TemporaryDirectory() as place,
                closing(Judge(chapter, limits, Path(place) / "data")) as judge,
            ):
                marks = partial(_marks, folder=folder, judge=judge, limits=limits)
                yield from threads.map(marks, paths)


def _stem(file: Path) -> str:
    """The name of a notebook, without what JupyterLab, a browser or a system adds to a copy's."""
    return COPY.sub("", file.stem)


def _unknown(file: Path) -> Mark:
    why = "The name of the file does not end in that of a chapter."
    return Mark(_student(file, file.stem), file.as_posix(), "", None, 0, why)


def _marks(path: Path, folder: Path, judge: Judge, limits: Limits) -> list[Mark]:
    """The marks of one notebook."""
    file, stem, chapter = path.relative_to(folder), _stem(path), judge.chapter
    student = _student(file, stem.removesuffix(chapter.name).rstrip("_- ") or stem)
    try:
        submission = matched(chapter, notebook_of(path))
    except (CannotGrade, OSError) as error:
        lost = {one.name: str(error) for one in chapter.exercises}
    else:
        lost = losses(judge, submission, limits)
    return [
        Mark(
            student,
            file.as_posix(),
            one.number,
            None if not one.parts["check"] else 0 if lost[one.name] else one.about.worth,
            one.about.worth,
            lost[one.name],
        )
        for one in chapter.exercises
    ]


def _student(file: Path, alone: str) -> str:
    """The folder of a student; what is left of the file's name where there is none."""
    return file.parts[0] if len(file.parts) > 1 else alone
