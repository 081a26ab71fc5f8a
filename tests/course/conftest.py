"""Grades of what students hand in."""

import csv
from contextlib import closing
from pathlib import Path

import editions
import nbformat
import pytest
from click.testing import CliRunner
from small_course import SMALL, small_chapter

from nmpcrl.commands import main
from nmpcrl.course.execution import Limits
from nmpcrl.course.judge import Judge
from nmpcrl.course.submissions import chapters, matched, notebook_of


@pytest.fixture
def edition(tmp_path) -> Path:
    """The edition for graders of the small chapter."""
    place, data = (tmp_path / "edition" / name for name in (f"source/{SMALL}", "data"))
    place.mkdir(parents=True)
    (data / "published").mkdir(parents=True)
    (data / "of_the_chapter.txt").write_text("4")
    nbformat.write(editions.grader(small_chapter(), set()), place / f"{SMALL}.ipynb")
    return tmp_path / "edition"


@pytest.fixture
def graded(tmp_path, edition):
    """By student, the rows of the CSV file by exercise."""

    def grade(*words, name=SMALL, **handed):
        for student, notebook in handed.items():
            place = tmp_path / "in" / student / f"{name}.ipynb"
            place.parent.mkdir(parents=True)
            text = notebook if isinstance(notebook, str) else nbformat.writes(notebook)
            place.write_text(text)
        out = tmp_path / "grades.csv"
        given = ["grade", str(tmp_path / "in"), "--out", str(out), "--edition", str(edition)]
        called = CliRunner().invoke(main, [*given, *words])
        assert called.exit_code == 0, called.output
        assert "no sandbox" in called.output
        with out.open(newline="") as file:
            rows = list(csv.DictReader(file))
        return {s: {r["exercise"]: r for r in rows if r["student"] == s} for s in handed}

    return grade


@pytest.fixture
def judge(edition, tmp_path):
    """What makes the checks of the small chapter."""
    (chapter,) = chapters(edition)
    with closing(Judge(chapter, Limits(), tmp_path / "data-of-judge")) as made:
        yield made


@pytest.fixture
def submission(edition):
    """A chapter, and what a student hands in for it."""

    def made(notebook):
        (chapter,) = chapters(edition)
        path = edition / "handed-in.ipynb"
        path.write_text(nbformat.writes(notebook))
        return chapter, matched(chapter, notebook_of(path))

    return made
