"""Make the editions for a course: notebooks for students, teachers and graders, with data; slides.

    python book/course.py              _build/course/student, instructor, grader and slides
    python book/course.py --otter      the third for otter in place of nbgrader
    python book/course.py --secret F   exercises with other numbers, drawn from what a file holds

The folder `grader` is one of a course of nbgrader's, with an assignment for each chapter, which
share the data; it is for teachers alone, and `nmpcrl grade` reads it.

Each folder can be handed out as it is. The first three hold the chapters that have exercises, the
library as a wheel, what to install with it and how, as `handout` says, the published study, and the
runs that would take long to train, as `offline` says.

The slides and the teachers' figures show what the last `make book` computed; a Chromium prints the
slides, too. Where they are not whole, all else is written, a sentence says why, and the exit code
is 1. If there is a built book, it offers all of this, as `downloads` says. Two builds give the same
bytes.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, BinaryIO

import click
import nbformat

from driver.course import autograded, downloads, editions, handout, offline, slides
from driver.page import pictures
from driver.project import ROOT, Failure, notebooks
from nmpcrl.course import variants
from nmpcrl.course.exercises import exercises

PLACE, SITE = Path("_build/course"), Path("_build/html")
EDITIONS: dict[str, Callable[..., Any]] = {
    "student": editions.student,
    "instructor": editions.teacher,
    "grader": editions.grader,
}
SINCE_1980 = "315532800"  # the earliest time that a ZIP file, so a wheel, can hold [s]
WHEEL = ("--no-deps", "--no-build-isolation", "--no-index", "--quiet")
PACKAGED = ("pyproject.toml", "README.md", "LICENSE")


def chapters() -> dict[str, Any]:
    """The notebooks that have exercises, by file name, in the order of _toc.yml."""
    read = {path.name: nbformat.read(ROOT / path, 4) for path in notebooks().values()}
    return {name: notebook for name, notebook in read.items() if any(exercises(notebook))}


@cache
def wheel(*, withheld: bool = False) -> tuple[str, bytes]:
    """The name and the bytes of the library as a wheel, built without a network.

    They are the same in every process, and built once in each.

    Args:
        withheld: without the checks of exercises whose numbers may be others.
    """
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / "nmpcrl", source / "nmpcrl", ignore=ignored)
        for path in (source / "nmpcrl/course/checks").glob("*.py") if withheld else ():
            path.write_text(variants.without(path.read_text("utf-8")), "utf-8")
        for name in PACKAGED:
            shutil.copy2(ROOT / name, source)
        command = [sys.executable, "-m", "pip", "wheel", *WHEEL, "-w", folder, str(source)]
        subprocess.run(command, check=True, env=os.environ | {"SOURCE_DATE_EPOCH": SINCE_1980})
        (made,) = Path(folder).glob("*.whl")
        return made.name, made.read_bytes()


def edition(
    name: str, place: Path, runs: Mapping[str, Path], *, otter: bool = False, secret: bytes = b""
) -> None:
    """Write one edition to a folder, which is made anew.

    Args:
        name: of the edition.
        place: the folder.
        runs: what else it holds, as `offline.stored` has it.
        otter: mark the notebooks of graders for otter.
        secret: from which other numbers are drawn; if empty, exercises are those of the book.
    """
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    library, content = wheel(withheld=bool(secret) and name == "student")
    (place / library).write_bytes(content)
    sources = chapters()
    make = partial(EDITIONS[name], otter=True) if otter else EDITIONS[name]
    assignments = name == "grader" and not otter
    files = {f: f"source/{Path(f).stem}/{f}" if assignments else f for f in sources}
    for file, source in sources.items():
        path = place / files[file]
        path.parent.mkdir(parents=True, exist_ok=True)
        given = variants.varied(source, secret) if secret else source
        nbformat.write(make(given, set(sources)), path)
    if assignments:
        (place / "nbgrader_config.py").write_text(autograded.NBGRADER_CONFIG)
    (place / "requirements.txt").write_text(handout.requirements(library))
    readme = handout.readme(name, library, first=next(iter(files.values())))
    (place / "README.md").write_text(readme)
    for data in ("published", "_static/live"):
        shutil.copytree(ROOT / "book" / data, place / "data" / Path(data).name)
    offline.copy(runs, place)


def figures(sources: Iterable[str], place: Path) -> None:
    """Write the figures of executed chapters, each to its folder in `place`."""
    for name in sources:
        folder = place / Path(name).stem
        folder.mkdir(parents=True)
        for file, data in drawn(slides.EXECUTED / name).items():
            (folder / file).write_bytes(data)


def drawn(executed: Path) -> dict[str, bytes]:
    """The figures of an executed chapter, by file name."""
    try:
        return pictures.vectors(nbformat.read(executed, 4))
    except (FileNotFoundError, KeyError) as missing:
        reason = f"Figures are those of an executed {executed.name}: `make book` executes it."
        raise Failure(reason) from missing


def decks(_: dict[str, Any], place: Path) -> None:
    """Write the slides of the course's units to a folder, as PDFs, too."""
    slides.printed(slides.make(slides.EXECUTED, place))


SHOWN: dict[str, Callable[[dict[str, Any], Path], None]] = {  # of the last build, by folder
    "instructor/figures": figures,
    "slides": decks,
}


def is_whole(name: str, sources: dict[str, Any]) -> bool:
    """Make one of `SHOWN`, or say why it is not whole; the notebooks need none of them."""
    try:
        SHOWN[name](sources, PLACE / name)
    except Failure as reason:
        click.echo(f"{PLACE / name} is not whole. {reason.message}")
        return False
    return True


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--otter", is_flag=True, help="An edition for graders with otter, too.")
@click.option(
    "--secret",
    type=click.File("rb"),
    help="A file from which other numbers are drawn; the built book offers no such edition.",
)
def main(otter: bool, secret: BinaryIO | None) -> None:
    """Write the editions to _build/course."""
    drawn_from = secret.read() if secret else b""
    if secret and not drawn_from:
        raise click.BadParameter("The file is empty.", param_hint="--secret")
    os.chdir(ROOT)
    sources = chapters()
    runs = offline.stored(sources)
    for name in EDITIONS:
        edition(name, PLACE / name, runs, secret=drawn_from)
    if otter:
        edition("grader", PLACE / "otter", runs, otter=True, secret=drawn_from)
    whole = [*EDITIONS, *(name for name in SHOWN if is_whole(name, sources))]
    made = [PLACE / name for name in whole] + [PLACE / "otter"] * otter
    if (SITE / "index.html").exists() and not secret:
        offered = [PLACE / name for name in whole if name in downloads.CONTENTS]
        made += downloads.offer(offered, SITE)
    for path in made:
        click.echo(path)
    if len(whole) < len(EDITIONS) + len(SHOWN):
        raise SystemExit(1)
