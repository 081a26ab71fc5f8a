"""`nmpcrl grade`: points of the notebooks that students hand in."""

import csv
from pathlib import Path
from typing import TYPE_CHECKING

import click

from nmpcrl.commands.places import NewFile
from nmpcrl.commands.tables import columns, counted

if TYPE_CHECKING:
    from nmpcrl.course.grading import Mark

FIELDS = ("student", "notebook", "exercise", "points", "of", "why")
HEADER = ("student", "notebook", "points", "of", "by hand")
FOLDER = click.Path(exists=True, file_okay=False, path_type=Path)
NO_SANDBOX = (
    "The notebooks ran with your rights: limits and a temporary folder are no sandbox."
    " See nmpcrl grade --help."
)


@click.command()
@click.argument("folder", type=FOLDER)
@click.option("--out", type=NewFile(), required=True, help="A CSV file, one row an exercise.")
@click.option(
    "--edition",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("_build/course/grader"),
    show_default=True,
    help="What `make course` writes for graders.",
)
@click.option(
    "--time-limit", type=click.IntRange(1), default=120, show_default=True, help="Seconds a run."
)
@click.option(
    "--memory", type=click.IntRange(100), default=2000, show_default=True, help="Megabytes a run."
)
def grade(folder: Path, out: Path, edition: Path, time_limit: int, memory: int) -> None:
    """Grade every notebook below FOLDER, and write the points to a file.

    FOLDER has a folder for each student, or notebooks such as
    anna_01_mdp_and_nmpc.ipynb. Each runs in a process and a temporary folder of
    its own. Answers and added cells are the student's; every other cell, so each
    check, is put back from the edition for graders. A cell that does not end in
    time, takes too much memory or ends the process is taken out, and the others
    run again without it. Projects are left to you.

    This is no sandbox for hostile code: a notebook has your rights, reads your
    files and reaches your network. Where you do not trust one, run this command in
    a container that has neither, after `nmpcrl` is installed in an image:

    \b
      docker run --rm --network none --read-only --tmpfs /tmp --tmpfs /root \\
        -v "$PWD/handed-in:/in:ro" -v "$PWD/grader:/edition:ro" \\
        -v "$PWD/marks:/out" IMAGE \\
        nmpcrl grade /in --edition /edition --out /out/grades.csv

    \b
    Example:
      nmpcrl grade . --out grades.csv --time-limit 60
    """
    from nmpcrl.course import grading
    from nmpcrl.course.confined import Limits

    limits = Limits(time_limit, memory)
    marks = []
    with out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(FIELDS)
        for mark in grading.grade(folder, edition, limits):
            marks.append(mark)
            writer.writerow(["" if (v := getattr(mark, f)) is None else v for f in FIELDS])
            file.flush()
    click.echo("\n".join(columns([HEADER, *totals(marks)], frozenset({2, 3, 4}))))
    notebooks = counted(len({mark.notebook for mark in marks}), "notebook")
    click.echo(f"\n{notebooks}, {counted(len(marks), 'row')} in {out}")
    click.echo(NO_SANDBOX)


def totals(marks: "list[Mark]") -> list[tuple[str, ...]]:
    """A row a notebook: points, points to be had from checks, and those that a person gives."""
    rows: list[tuple[str, ...]] = []
    for student, notebook in dict.fromkeys((mark.student, mark.notebook) for mark in marks):
        mine = [mark for mark in marks if mark.notebook == notebook]
        checked = [(mark.points, mark.of) for mark in mine if mark.points is not None]
        got, of = (sum(pair[k] for pair in checked) for k in (0, 1))
        by_hand = sum(mark.of for mark in mine if mark.points is None)
        rows.append((student, notebook, str(got), str(of), str(by_hand)))
    return rows
