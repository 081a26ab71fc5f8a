"""Grades of what students hand in."""

from contextlib import closing
from functools import partial
from pathlib import Path

import nbformat
import pytest
from small_course import edition_in, graded_in

from nmpcrl.course.execution import Limits
from nmpcrl.course.judge import Judge
from nmpcrl.course.submissions import chapters, matched, notebook_of


@pytest.fixture
def edition(tmp_path) -> Path:
    """The edition for graders of the small chapter."""
    return edition_in(tmp_path)


@pytest.fixture
def graded(tmp_path, edition):
    """By student, the rows of the CSV file by exercise."""
    return partial(graded_in, tmp_path, edition)


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
