"""The chapters themselves, graded: as nbgrader does, and with all points for all solutions."""

import csv
import json
import os
import shutil
import sqlite3
import subprocess
import sys
import venv
from copy import deepcopy
from pathlib import Path

import nbformat
import pytest
from driver.course import course

from nmpcrl.course.execution import Limits
from nmpcrl.course.exercises import exercises
from nmpcrl.course.grading import grade
from nmpcrl.course.variants import varied

CHAPTER = "01_mdp_and_nmpc"
SOURCES = course.chapters()
NBGRADER = "nbgrader==0.9.6"
SCORES = """
select student_id, base_cell.name, auto_score from grade
join base_cell on base_cell.id = cell_id
join submitted_notebook on submitted_notebook.id = grade.notebook_id
join submitted_assignment on submitted_assignment.id = submitted_notebook.assignment_id
where auto_score is not null"""

pytestmark = pytest.mark.course


def with_one_chapter(folder: Path, name: str) -> Path:
    """An edition for graders without its other chapters."""
    for place in (folder / "source").iterdir():
        if place.name != Path(name).stem:
            shutil.rmtree(place)
    return folder


def answered(notebook, every):
    """A notebook with the solutions of some exercises."""
    pairs = [pair for one in every for pair in zip(one.parts["answer"], one.answers, strict=True)]
    right = {cell.id: code for cell, code in pairs}
    for cell in notebook.cells:
        cell.source = right.get(cell.id, cell.source)
    return notebook


@pytest.mark.parametrize("name", SOURCES)
def test_all_solutions_of_a_chapter_have_all_points(name, edition_of_course, tmp_path):
    edition = with_one_chapter(edition_of_course("grader"), name)
    student = course.EDITIONS["student"](SOURCES[name], set(SOURCES))
    (tmp_path / "in").mkdir()
    nbformat.write(answered(student, exercises(SOURCES[name])), tmp_path / "in" / name)
    (marks,) = grade(tmp_path / "in", edition, Limits(seconds=1800))
    checked = [mark for mark in marks if mark.points is not None]
    assert [(mark.exercise, mark.why) for mark in checked if mark.points != mark.of] == []
    assert len(checked) == len(marks) - 1  # the project


def test_with_a_secret_its_own_solutions_have_all_points_and_published_ones_none(tmp_path):
    name, secret = f"{CHAPTER}.ipynb", b"a secret"
    course.edition("grader", tmp_path / "grader", {}, secret=secret)
    other = varied(SOURCES[name], secret)
    student = course.EDITIONS["student"](other, set(SOURCES))
    for who, source in {"own": other, "published": SOURCES[name]}.items():
        (tmp_path / "in" / who).mkdir(parents=True)
        notebook = answered(deepcopy(student), exercises(source))
        nbformat.write(notebook, tmp_path / "in" / who / name)
    own, published = grade(tmp_path / "in", tmp_path / "grader", Limits(seconds=1800))
    worth = {mark.exercise: mark.of for mark in own if mark.points is not None}
    assert {number for number, of in worth.items() if of} == {"1.1"}
    assert {m.exercise: m.points for m in own if m.points is not None} == worth
    assert sum(mark.points or 0 for mark in published) == 0


@pytest.fixture(scope="session")
def nbgrader(request) -> Path:
    """A Python that has nbgrader, from the registry, once in pytest's own cache."""
    folder = request.config.cache.mkdir(NBGRADER.replace("==", "-"))
    python, ready = folder / "bin/python", folder / "ready"
    if not ready.exists():
        venv.create(folder, with_pip=True, clear=True)
        install = [python, "-m", "pip", "install", "-q", "--retries", "1", NBGRADER]
        done = subprocess.run(install, capture_output=True, text=True)
        if done.returncode:
            lines = done.stderr.strip().splitlines()
            reason = f"{NBGRADER} cannot be installed: {lines[-1] if lines else 'no message'}"
            (pytest.fail if os.environ.get("NMPCRL_REQUIRE_REGISTRY") else pytest.skip)(reason)
        ready.touch()
    return python


def test_nbgrader_gives_the_same_points(nbgrader, edition_of_course, tmp_path):
    name = f"{CHAPTER}.ipynb"
    folder = with_one_chapter(edition_of_course("grader"), name)
    called(nbgrader, folder, "generate_assignment", CHAPTER)
    released = folder / "release" / CHAPTER / name
    assert "SOLUTION" not in released.read_text()
    assert "MARK SCHEME" not in released.read_text()
    every = list(exercises(SOURCES[name]))
    for student, solved in {"untouched": [], "half": every[:3], "perfect": every}.items():
        submitted = folder / "submitted" / student / CHAPTER
        for path in (submitted / name, tmp_path / "in" / student / name):
            path.parent.mkdir(parents=True, exist_ok=True)
            nbformat.write(answered(nbformat.read(released, 4), solved), path)
    called(nbgrader, folder, "autograde", CHAPTER)
    called(nbgrader, folder, "export", "--to", str(tmp_path / "theirs.csv"))

    given = [m for marks in grade(tmp_path / "in", folder, Limits()) for m in marks]
    marks = [m for m in given if m.points is not None]
    checks = {one.parts["check"][0].id: one.number for one in every if one.parts["check"]}
    with sqlite3.connect(folder / "gradebook.db") as book:
        theirs = {(who, checks[cell]): score for who, cell, score in book.execute(SCORES)}
    assert theirs == {(mark.student, mark.exercise): mark.points for mark in marks}
    with (tmp_path / "theirs.csv").open(newline="") as file:
        totals = {row["student_id"]: float(row["raw_score"]) for row in csv.DictReader(file)}
    assert totals["untouched"] == 0 < totals["half"] < totals["perfect"]
    assert totals["perfect"] == sum(one.about.points for one in every if one.parts["check"])


def called(python: Path, folder: Path, *words: str) -> None:
    """Call nbgrader; its kernel is this Python, which has the library."""
    kernel = folder / "jupyter/kernels/python3"
    kernel.mkdir(parents=True, exist_ok=True)
    argv = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    about = {"argv": argv, "display_name": "Python 3", "language": "python"}
    (kernel / "kernel.json").write_text(json.dumps(about))
    paths = {
        "JUPYTER_PATH": str(folder / "jupyter"),
        "PATH": f"{python.parent}:{os.environ['PATH']}",
    }
    done = subprocess.run(
        [python, "-m", "nbgrader", *words],
        cwd=folder,
        env=os.environ | paths,  # it calls a command of its own, alembic
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-3000:]
