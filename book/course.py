"""Make the editions for a course: notebooks for students, teachers and graders, with data; slides.

    python book/course.py              _build/course/student, instructor, grader and slides
    python book/course.py --otter      the third for otter in place of nbgrader

The folder `grader` is one of a course of nbgrader's, with one assignment, `nmpcrl`; it is for
teachers alone, and `nmpcrl grade` reads it.

Each folder can be handed out as it is. The first two hold the chapters that have exercises, the
library as a wheel, the libraries to install with it, and the published study; the slides, which
show what the last `make book` computed, are also PDFs if there is a Chromium. Two builds give the
same bytes, but for PDFs.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import autograded
import build
import click
import editions
import nbformat
import slides

from nmpcrl.course.exercises import exercises

ROOT = build.ROOT
EDITIONS: dict[str, Callable[..., Any]] = {
    "student": editions.student,
    "instructor": editions.teacher,
    "grader": editions.grader,
}
WITHIN = {"grader": "source/nmpcrl"}  # where in its folder an edition is, if not there itself
SINCE_1980 = "315532800"  # the earliest time that a ZIP file, so a wheel, can hold [s]
WHEEL = ("--no-deps", "--no-build-isolation", "--no-index", "--quiet")
PACKAGED = ("pyproject.toml", "LICENSE")


def chapters() -> dict[str, Any]:
    """The notebooks that have exercises, by file name, in the order of _toc.yml."""
    read = {path.name: nbformat.read(ROOT / path, 4) for path in build.notebooks().values()}
    return {name: notebook for name, notebook in read.items() if any(exercises(notebook))}


def wheel(place: Path) -> Path:
    """The library as a wheel at `place`, without a network, the same bytes every time."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / "nmpcrl", source / "nmpcrl", ignore=ignored)
        for name in PACKAGED:
            shutil.copy2(ROOT / name, source)
        command = [sys.executable, "-m", "pip", "wheel", *WHEEL, "-w", str(place), str(source)]
        subprocess.run(command, check=True, env=os.environ | {"SOURCE_DATE_EPOCH": SINCE_1980})
    (made,) = place.glob("*.whl")
    return made


def edition(name: str, place: Path, *, otter: bool = False) -> None:
    """Write one edition to a folder, which is made anew; that of graders perhaps for otter."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    library = wheel(place).name
    sources = chapters()
    make = partial(EDITIONS[name], otter=True) if otter else EDITIONS[name]
    for file, source in sources.items():
        nbformat.write(make(source, set(sources), library), place / file)
    shutil.copy2(ROOT / "environment.txt", place)
    for data in ("published", "_static/live"):
        shutil.copytree(ROOT / "book" / data, place / "data" / Path(data).name)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--otter", is_flag=True, help="Mark the notebooks of graders for otter.")
def main(otter: bool) -> None:
    """Write the editions to _build/course."""
    os.chdir(ROOT)
    for name in EDITIONS:
        folder = Path("_build/course") / name
        edition(name, folder / WITHIN.get(name, ""), otter=otter and name == "grader")
        click.echo(folder)
    Path("_build/course/grader/nbgrader_config.py").write_text(autograded.NBGRADER_CONFIG)
    try:
        slides.printed(slides.make(chapters(), slides.EXECUTED, Path("_build/course/slides")))
        click.echo("_build/course/slides")
    except build.Failure as reason:  # the notebooks need neither
        click.echo(f"_build/course/slides is not whole. {reason.message}")


if __name__ == "__main__":
    main()
