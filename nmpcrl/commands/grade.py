"""`nmpcrl grade`: points of the notebooks that students hand in."""

import csv
from dataclasses import astuple, fields
from itertools import chain
from pathlib import Path

import click

from nmpcrl.commands.options import new_file, number

FORMULA = ("=", "+", "-", "@", "\t", "\r")  # first characters of a spreadsheet's formulas


@click.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--out", metavar="FILE", type=new_file, required=True, help="A CSV file, one row an exercise."
)
@click.option(
    "--release",
    type=click.Path(file_okay=False, path_type=Path),
    default="_build/course/student",
    help="The notebooks that students got, as `make course` writes them.",
)
@number("--seconds", 1, 60, "Limit of a cell of an exercise, or of one that a student added.")
@number("--memory", 100, 4000, "Limit of a notebook's data in megabytes; not on Windows.")
@number("--workers", 1, 1, "Notebooks at a time.")
def grade(folder: Path, out: Path, release: Path, seconds: int, memory: int, workers: int) -> None:
    """Grade the notebooks that students hand in.

    FOLDER has a folder of notebooks for each student, or notebooks such as
    anna_01_mdp_and_nmpc.ipynb. Each runs in a kernel and a temporary folder of
    its own. Answers and added cells are the student's; every other cell, so each
    check, is the release's. A cell that hangs or ends its process costs its
    exercise, and the others run again without it.

    This is no sandbox. A notebook runs with your rights: it can read your files
    and use your network, and an answer that changes the library in memory can win
    points for nothing. Where grades count, read the answers, and run this command
    in a container without a network.

    \b
    Example:
      nmpcrl grade handed-in --out grades.csv
    """
    from nmpcrl.course import grading

    limits = grading.Limits(seconds=seconds, megabytes=memory)
    graded = grading.grade(folder, release, limits, workers)
    first = next(graded)  # an earlier table stays until there is something to write
    with out.open("w", newline="", encoding="utf-8", errors="replace") as file:
        writer = csv.writer(file)
        writer.writerow(one.name for one in fields(grading.Mark))
        for marks in chain([first], graded):
            writer.writerows([text(value) for value in astuple(mark)] for mark in marks)
            file.flush()
            got, of = sum(mark.points for mark in marks), sum(mark.of for mark in marks)
            click.echo(f"{marks[0].student}: {marks[0].notebook}: {got} of {of}")


def text(value: object) -> object:
    """A cell that no spreadsheet computes: one that begins as a formula does is quoted."""
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else value
