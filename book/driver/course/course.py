"""Make the material of a course in _build/course: three editions of the notebooks, and slides.

student      notebooks with empty answers; `nmpcrl grade` takes their checks
instructor   the same with solutions and speaker notes
nbgrader     a course of nbgrader's, with an assignment for each chapter
slides       a deck for each chapter that the last `make book` executed
"""

import os
import shutil
from pathlib import Path
from typing import Any

import click
import nbformat

from driver.course import editions, slides
from driver.project import ROOT, Failure, notebooks
from nmpcrl.course.exercises import exercises

PLACE, EXECUTED = Path("_build/course"), Path("_build/executed")


def chapters() -> dict[str, Any]:
    """The notebooks that have exercises, by file name, in the order of _toc.yml."""
    read = {path.name: nbformat.read(ROOT / path, 4) for path in notebooks().values()}
    return {name: notebook for name, notebook in read.items() if any(exercises(notebook))}


def write(place: Path) -> None:
    """Write the three editions to a folder, each made anew."""
    sources = chapters()
    for name, make in {
        "student": editions.student,
        "instructor": editions.teacher,
        "nbgrader": editions.for_nbgrader,
    }.items():
        shutil.rmtree(place / name, ignore_errors=True)
        for file, source in sources.items():
            inside = f"source/{Path(file).stem}" if name == "nbgrader" else ""
            (place / name / inside).mkdir(parents=True, exist_ok=True)
            nbformat.write(make(source, sources), place / name / inside / file)
    (place / "nbgrader/nbgrader_config.py").write_text(editions.NBGRADER_CONFIG)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
def main() -> None:
    """Write notebooks for students, teachers and nbgrader, and slides, to _build/course."""
    os.chdir(ROOT)
    write(PLACE)
    executed = [path for name in chapters() if (path := EXECUTED / name).exists()]
    if not executed:
        raise Failure(
            f"{PLACE} has the notebooks and no slides: these show what `make book` computes."
        )
    slides.write(executed, PLACE / "slides")
    for path in sorted(PLACE.iterdir()):
        click.echo(path)
