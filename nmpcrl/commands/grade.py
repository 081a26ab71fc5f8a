"""`nmpcrl grade`: points of the notebooks that students hand in."""

import csv
import re
from dataclasses import astuple, fields
from itertools import chain
from pathlib import Path

import click

from nmpcrl.commands.options import new_file, number

FORMULA = ("=", "+", "-", "@", "\t", "\r")  # first characters of a spreadsheet's formulas
CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f]")  # characters that control a terminal
NO_SANDBOX = (
    "The notebooks ran with your rights: limits and a temporary folder are no sandbox."
    " See nmpcrl grade --help."
)


@click.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--out", metavar="FILE", type=new_file, required=True, help="A CSV file, one row an exercise."
)
@click.option(
    "--edition",
    type=click.Path(file_okay=False, path_type=Path),
    default="_build/course/grader",
    help="What `make course` writes for graders.",
)
@number("--time-limit", 1, 600, "Seconds a notebook, all its runs together.")
@number("--cell-limit", 1, 60, "Seconds a cell of an exercise, or one that a student added.")
@number("--memory", 100, 2000, "Megabytes a notebook.")
@number("--workers", 1, 1, "Notebooks at a time.")
def grade(
    folder: Path, out: Path, edition: Path, time_limit: int, cell_limit: int, memory: int,
    workers: int,
) -> None:  # fmt: skip
    """Grade the notebooks that students hand in.

    FOLDER has a folder of notebooks for each student, or notebooks such as
    anna_01_mdp_and_nmpc.ipynb. Each runs in a process and a temporary folder of
    its own. Answers and added cells are the student's; every other cell, so each
    check, is put back from the edition for graders. Where a cell does not end in
    time, takes too much memory or ends the process, its exercise gets no points,
    and the others run again without it. Projects are left to you.

    Checks run in another process, which gets plain values from the notebook: what
    it changes in its own memory wins no points. This is no sandbox all the same: a
    notebook has your rights, so hostile code reads your files, the solutions among
    them, reaches your network, and can attack your other processes. Where you do
    not trust one, run this command as another user in a container that has no network
    and no files but these, from an image in which nmpcrl is installed:

    \b
      docker run --rm --network none --read-only --cap-drop ALL \\
        --user "$(id -u):$(id -g)" --memory 4g --pids-limit 512 \\
        --tmpfs /tmp:exec -e HOME=/tmp \\
        -v "$PWD/handed-in:/in:ro" -v "$PWD/grader:/edition:ro" \\
        -v "$PWD/marks:/out" IMAGE \\
        nmpcrl grade /in --edition /edition --out /out/grades.csv

    \b
    Example:
      nmpcrl grade . --out grades.csv --time-limit 300
    """
    import pandas as pd

    from nmpcrl.course import grading
    from nmpcrl.course.execution import Limits

    totals = []
    graded = grading.grade(folder, edition, Limits(time_limit, cell_limit, memory), workers)
    first = next(graded)  # an earlier table stays until there is something to write
    with out.open("w", newline="", encoding="utf-8", errors="replace") as file:
        writer = csv.writer(file)
        writer.writerow(one.name for one in fields(first[0]))
        for marks in chain([first], graded):
            checked = [mark for mark in marks if mark.points is not None]
            got, of = sum(mark.points or 0 for mark in checked), sum(mark.of for mark in checked)
            by_hand = sum(mark.of for mark in marks) - of
            student, notebook = cell(marks[0].student), cell(marks[0].notebook)
            writer.writerows(map(cell, astuple(mark)) for mark in marks)
            left = f"{by_hand} more are given by hand." if by_hand else ""
            writer.writerow((student, notebook, "total", got, of, left))
            file.flush()
            click.echo(f"{notebook}: {got} of {of}", err=True)
            totals.append((student, notebook, got, of, by_hand))
    header = ("student", "notebook", "points", "of", "by hand")
    click.echo(pd.DataFrame(totals, columns=header).to_string(index=False))
    click.echo(f"\n{len(totals)} notebooks in {out}\n{NO_SANDBOX}")


def cell(value: object) -> object:
    """A cell that no spreadsheet computes and no terminal obeys: formulas are quoted."""
    if not isinstance(value, str):
        return value
    return CONTROL.sub("?", f"'{value}" if value[:1] in FORMULA else value)
