"""Points of what students hand in: a release's checks, run on their answers by nbclient.

This is no sandbox. A notebook runs with the rights of whoever grades, and an answer that changes
the library in memory can win points for nothing; see `nmpcrl grade --help`.
"""

import asyncio
import os
import re
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellTimeoutError, DeadKernelError
from nbformat.v4 import new_code_cell, new_notebook

from nmpcrl.course.exercises import HEAD, Cell, Exercise, Notebook, exercises, tags_of
from nmpcrl.course.outcome import Unsolved
from nmpcrl.study.files import folder as folder_of_runs
from nmpcrl.study.refusal import Refusal

COPY = re.compile(r"(-Copy\d+| ?\(\d+\)| -? ?copy(?: \d+)?)+$", re.IGNORECASE)  # of a file's name
MEMORY = """try:
    import resource

    resource.setrlimit(resource.RLIMIT_DATA, ({0}, {0}))
except ImportError:
    pass  # Windows limits no memory of a process"""
LONGEST = 500  # letters of a sentence: what a student's object calls itself may have more


class CannotGrade(Refusal):
    """There is nothing to grade, or nothing to grade it with."""


@dataclass(frozen=True)
class Limits:
    """What a notebook may take."""

    seconds: int = 60  # of a cell of an exercise, or of one that a student added
    chapter: int = 600  # seconds of any other cell: a chapter may train
    megabytes: int = 4000  # of data, where the system can limit it


@dataclass(frozen=True)
class Mark:
    """The points of a student for an exercise: a row of the table."""

    student: str
    notebook: str  # the file, from the folder of all
    exercise: str  # its number; empty if the notebook could not be matched or read
    points: int
    of: int
    why: str = ""  # points were lost


def grade(folder: Path, release: Path, limits: Limits, workers: int = 1) -> Iterator[list[Mark]]:
    """The marks of every notebook below a folder, in the order of their paths.

    Args:
        folder: of a folder for each student, or of notebooks whose names end in the chapter's.
        release: the folder of the notebooks that students got.
        limits: of each notebook.
        workers: how many notebooks are executed at a time.

    Raises:
        CannotGrade: a folder has no notebook, or a released chapter fails on this computer.
    """
    read = {path.stem: nbformat.read(path, 4) for path in sorted(release.glob("*.ipynb"))}
    chapters = {name: one for name, one in read.items() if any(exercises(one))}
    if not chapters:
        raise CannotGrade(f"{release} has no notebook with exercises; `make course` writes some")
    paths = [p for p in sorted(folder.rglob("*.ipynb")) if ".ipynb_checkpoints" not in p.parts]
    if not paths:
        raise CannotGrade(f"{folder} has no notebook")
    for name in sorted({_chapter(path, chapters) for path in paths} - {""}):
        _rehearse(name, chapters[name], limits)
    with ThreadPoolExecutor(workers) as threads:
        marks = partial(_marks, folder=folder, chapters=chapters, limits=limits)
        yield from threads.map(marks, paths)


def _stem(path: Path) -> str:
    """The name of a notebook, without what JupyterLab, a browser or a system adds to a copy's."""
    return COPY.sub("", path.stem)


def _chapter(path: Path, chapters: Mapping[str, Notebook]) -> str:
    """The chapter of a notebook by the end of its name, or nothing."""
    return next((name for name in chapters if _stem(path).endswith(name)), "")


def _rehearse(name: str, release: Notebook, limits: Limits) -> None:
    """Run a chapter without its exercises, so that what it trains is stored."""
    cells = [cell for cell in combined(release, release) if not cell.metadata.exercise]
    if halt := _run(cells, limits):
        raise CannotGrade(f"{name} itself was stopped on this computer: {halt[1]}")
    if error := next(filter(None, map(_error, cells)), None):
        raise CannotGrade(f"{name} itself fails on this computer with {': '.join(error)}")


def _marks(
    path: Path, folder: Path, chapters: Mapping[str, Notebook], limits: Limits
) -> list[Mark]:
    """The marks of one notebook."""
    name = _chapter(path, chapters)
    file, alone = path.relative_to(folder), _stem(path).removesuffix(name).rstrip("_- ")
    student = file.parts[0] if len(file.parts) > 1 else alone or path.stem
    mark = partial(Mark, student, file.as_posix())
    if not name:
        return [mark("", 0, 0, "The name of the file does not end in that of a chapter.")]
    every = list(exercises(chapters[name]))
    try:
        lost = losses(chapters[name], nbformat.read(path, 4), limits)
    except (ValueError, KeyError, AttributeError, TypeError):  # nbformat's, of any file
        lost = dict.fromkeys((one.name for one in every), "The file is not a notebook.")
    return [
        mark(one.number, 0 if lost[one.name] else one.points, one.points, lost[one.name])
        for one in every
    ]


def losses(release: Notebook, handed: Notebook, limits: Limits) -> dict[str, str]:
    """Why the points of an exercise are lost, by its name; empty where they are not.

    A cell that has to be stopped costs its exercise: the others run again without it.
    """
    stopped = dict[str, str]()
    while True:
        cells = [c for c in combined(release, handed) if c.metadata.exercise not in stopped]
        halt = _run(cells, limits)
        if halt is None or not halt[0].metadata.exercise:
            break
        stopped[halt[0].metadata.exercise] = f"It was stopped: {halt[1]}."
    ran = {cell.id: cell for cell in cells}
    return {one.name: stopped.get(one.name) or _loss(one, ran) for one in exercises(release)}


def _loss(one: Exercise, ran: Mapping[str, Cell]) -> str:
    """Why an exercise gets no points, if it gets none."""
    answers, checks = ([ran[cell.id] for cell in one.parts[part]] for part in ("answer", "check"))
    failed = next(filter(None, map(_error, checks)), None)
    if failed is None:
        done = all(cell.execution_count for cell in checks)
        return "" if done else "The notebook was stopped before it."
    name, message = failed
    if name == Unsolved.__name__:
        return message
    name, message = next(filter(None, map(_error, answers)), failed)
    return f"It fails with {name}: {message}"


def _error(cell: Cell) -> tuple[str, str] | None:
    """The name of the error of a cell and the first line of its message, if it has one."""
    for output in cell.outputs:
        if output.output_type == "error":
            return output.ename, output.evalue.strip().partition("\n")[0][:LONGEST]
    return None


def combined(release: Notebook, handed: Notebook) -> list[Cell]:
    """The code of a release with the answers and the added cells of a notebook handed in.

    An answer is known by its cell's id or, where an editor gave it another, by its tag below the
    text of its exercise. The metadata of a cell name its exercise, or itself if it was added
    outside of one.
    """
    every = list(exercises(release))
    owner = {cell.id: one.name for one in every for cell in one.cells}
    answers = {one.name: one.parts["answer"][0].id for one in every}
    ours = {cell.id: cell.source for cell in release.cells}
    given, added, last, exercise = dict[str, str](), defaultdict[str, list[Cell]](list), "", ""
    for cell in handed.cells:
        head = HEAD.match(cell.source)
        exercise = head["name"] if head else exercise
        name = cell.get("id", "")
        if name not in ours and "answer" in tags_of(cell):
            name = answers.get(exercise, name)
        if name in ours:
            last = name
            given[name] = cell.source if cell.cell_type == "code" else ""  # nobody ran its text
        elif cell.cell_type == "code" and cell.source not in ours.values():
            added[last].append(cell)
    cells = [_code(one.source, f"added-{k}", f"added-{k}") for k, one in enumerate(added[""])]
    for cell in release.cells:
        group = owner.get(cell.id, "")
        if cell.cell_type == "code":
            theirs = cell.id in answers.values()
            cells.append(_code(given.get(cell.id, "") if theirs else cell.source, cell.id, group))
        for k, one in enumerate(added[cell.id]):
            name = f"{cell.id}-added-{k}"
            cells.append(_code(one.source, name, group or name))
    return cells


def _code(source: str, name: str, exercise: str) -> Cell:
    return new_code_cell(source, id=name, metadata={"exercise": exercise})


def _run(cells: list[Cell], limits: Limits) -> tuple[Cell, str] | None:
    """Execute cells in a fresh kernel; where it had to be stopped, the cell and why."""
    begun = []
    memory = _code(MEMORY.format(1_000_000 * limits.megabytes), "memory", "")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as place:
        client = NotebookClient(
            new_notebook(cells=[memory, *cells]),
            kernel_name="python3",
            allow_errors=True,
            shutdown_kernel="immediate",
            timeout_func=lambda cell: limits.seconds if cell.metadata.exercise else limits.chapter,
            on_cell_start=lambda cell, cell_index: begun.append(cell),
        )
        runs = str(folder_of_runs().absolute())
        try:
            asyncio.run(client.async_execute(cwd=place, env=os.environ | {"NMPCRL_RUNS": runs}))
        except CellTimeoutError:
            return begun[-1], f"a cell took longer than {limits.seconds} s"
        except DeadKernelError:
            return begun[-1], "a cell ended the process"
    return None
