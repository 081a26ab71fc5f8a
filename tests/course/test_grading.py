"""Grades of what students hand in: `nmpcrl grade` on a small chapter, with real kernels."""

import csv
from pathlib import Path

import nbformat
import pytest
from click.testing import CliRunner
from driver.course import editions
from nbformat.v4 import new_code_cell
from small_course import ASKED, cell_of, small_chapter

from nmpcrl.commands import main

SMALL = "01_small"
pytestmark = pytest.mark.slow  # it starts kernels


@pytest.fixture
def release(tmp_path) -> Path:
    """What students got."""
    folder = tmp_path / "release"
    folder.mkdir()
    nbformat.write(editions.student(small_chapter(), set()), folder / f"{SMALL}.ipynb")
    return folder


def solved(**answers):
    """The notebook of a student who solves all exercises, but for some other answers."""
    notebook = editions.student(small_chapter(), set())
    for name in ASKED:
        answer = answers.get(name, f"root_of_{name} = 2")
        cell_of(notebook, f"{name}-answer").source = answer
    return notebook


@pytest.fixture
def graded(tmp_path, release, runs):
    """By student, why points are lost, by exercise: "" where none are."""

    def grade(*words: str, **handed):
        for student, notebook in handed.items():
            place = tmp_path / "in" / student / f"{SMALL}.ipynb"
            place.parent.mkdir(parents=True)
            text = notebook if isinstance(notebook, str) else nbformat.writes(notebook)
            place.write_text(text)
        out = tmp_path / "grades.csv"
        given = ["grade", str(tmp_path / "in"), "--out", str(out), "--release", str(release)]
        called = CliRunner().invoke(main, [*given, *words])
        assert called.exit_code == 0, called.output
        with out.open(newline="") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            assert row["of"] == row["exercise"].removeprefix("1.")
            assert row["points"] == ("0" if row["why"] else row["of"])
        return {s: [row["why"] for row in rows if row["student"] == s] for s in handed}

    return grade


def test_points_are_lost_with_a_sentence_and_only_where_they_must(graded):
    unrun = solved()
    cell_of(unrun, "one-answer").cell_type = "markdown"
    lost = graded(
        "--seconds", "5", "--workers", "2",
        right=solved(),
        wrong=solved(one="root_of_one = 4.0", two="root_of_two = unknown", three="a = (", four=""),
        loops=solved(two="while True: pass"),
        ends=solved(three="import os; os._exit(3)"),
        large=solved(one="root_of_one = 'x' * 10**11"),
        broken="{",
        unrun=unrun,
    )  # fmt: skip
    assert lost["right"] == ["", "", "", ""]
    assert lost["wrong"][0] == "Take the root."
    assert lost["wrong"][1] == "It fails with NameError: name 'unknown' is not defined"
    assert lost["wrong"][2].startswith("It fails with SyntaxError: ")
    assert lost["wrong"][3] == "It fails with NameError: name 'root_of_four' is not defined"
    assert lost["loops"] == ["", "It was stopped: a cell took longer than 5 s.", "", ""]
    assert lost["ends"] == ["", "", "It was stopped: a cell ended the process.", ""]
    assert lost["large"][0].startswith("It fails with MemoryError")
    assert lost["large"][1:] == ["", "", ""]
    assert lost["broken"] == ["The file is not a notebook."] * 4
    assert lost["unrun"][0] == "It fails with NameError: name 'root_of_one' is not defined"
    assert lost["unrun"][1:] == ["", "", ""]


def test_what_else_a_student_changes_does_not_matter(graded):
    checks, ids, own = solved(one="root_of_one = 3"), solved(), solved(one="root_of_one = half()")
    cell_of(checks, "one-check").source = "pass"
    for cell in ids.cells:
        cell.id = f"other-{cell.id}"
    at = own.cells.index(cell_of(own, "chapter"))
    own.cells.insert(at + 1, new_code_cell("def half():\n    return four / 2", id="own"))
    magic = solved(
        one="%matplotlib inline\n!echo hello\nroot_of_one = 2", two="%%time\nroot_of_two = 2"
    )
    lost = graded(checks=checks, ids=ids, own=own, magic=magic)
    assert lost["checks"] == ["3 is not right: it is too large.", "", "", ""]
    assert lost["ids"] == lost["own"] == lost["magic"] == ["", "", "", ""]


def test_a_folder_without_notebooks_is_refused(tmp_path, release):
    (tmp_path / "in").mkdir()
    given = ["grade", str(tmp_path / "in"), "--out", str(tmp_path / "grades.csv")]
    called = CliRunner().invoke(main, [*given, "--release", str(release)])
    assert called.exit_code == 1
    assert "in has no notebook" in called.output
    called = CliRunner().invoke(main, [*given, "--release", str(tmp_path / "in")])
    assert "in has no notebook with exercises" in called.output
    assert not (tmp_path / "grades.csv").exists()


def test_no_text_of_a_student_becomes_a_formula_of_a_spreadsheet():
    from nmpcrl.commands.grade import text

    assert text("=1+1") == "'=1+1"
    assert text("Take the root.") == "Take the root."
