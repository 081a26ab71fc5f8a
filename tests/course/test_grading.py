"""Grading: what students hand in, run as strangers' code that hangs, ends or cheats."""

import json
from contextlib import closing
from itertools import chain
from pathlib import Path

import nbformat
import pytest
from click.testing import CliRunner
from driver.course import course, editions
from nbformat.v4 import new_code_cell, new_markdown_cell
from small_course import (
    ASKED,
    SMALL,
    cell_of,
    edition_in,
    graded_in,
    small_chapter,
    solved_by_student,
)

from nmpcrl.commands import main
from nmpcrl.commands.grade import cell
from nmpcrl.course import grading
from nmpcrl.course.execution import Limits
from nmpcrl.course.exercises import exercises, solved
from nmpcrl.course.grading import grade
from nmpcrl.course.judge import Judge
from nmpcrl.course.submissions import CannotGrade, chapters

POINTS = {f"1.{number}": number for number in range(1, len(ASKED) + 1)}
SLEEPS = "import time\ntime.sleep(10**6)"
LINES = "import os\nfor file in range(3, 256):\n    try:\n        os.write(file, b'{')\n"
LINES += "    except OSError:\n        pass\nroot_of_six = 2"
GROWS = "taken = []\nwhile True:\n    taken.append(bytearray(10**8))"


def expected(*lost: str) -> dict[str, int]:
    return {number: 0 if number in lost else of for number, of in POINTS.items()}


def points(rows) -> dict[str, int]:
    return {number: int(row["points"]) for number, row in rows.items() if number in POINTS}


def reasons(rows) -> dict[str, str]:
    return {number: row["why"] for number, row in rows.items() if number in POINTS}


def half_solved():
    return solved_by_student(**dict.fromkeys(ASKED[3:], "pass"), two="root_of_two = 16")


def renaming():
    """Gives names of the chapter other meanings, and leaves its folder."""
    other = {
        "one": "four = sorted = None\nroot_of_one = 3",
        "two": "import os\nos.chdir('/')\nroot_of_two = 2\nfour = 5",
        "three": "root_of_three = int(len(open('data/of_the_chapter.txt').read()) * four ** 0.5)",
        "four": "%reset -f\nroot_of_four = 2",
        "five": "check = print\nroot_of_five = 2",
        "six": "root_of_six = sorted([four])[0] ** 0.5",
        "seven": "root_of_seven = root_of_six",
    }
    return solved_by_student(**other)


def relying():
    """Relies on names that it gave another meaning."""
    notebook = solved_by_student(one="root_of_one = five", three="root_of_three = 3")
    at = notebook.cells.index(cell_of(notebook, "chapter"))
    notebook.cells.insert(at + 1, new_code_cell("five = 2; max = 2"))
    cell_of(notebook, "six-answer").source = "root_of_six = max"
    return notebook


def editing_checks():
    notebook = solved_by_student(two="root_of_two = 3")
    one, two, three = list(exercises(notebook))[:3]
    one.parts["check"][0].source = "1 / 0"
    two.parts["check"][0].source = "'Right: 2.'"
    notebook.cells.remove(three.parts["check"][0])
    notebook.cells.append(new_code_cell("class check:\n    four = print"))
    strict = cell_of(notebook, "setup")
    strict.source = strict.source.replace('"1"', '""')
    return notebook


def silencing(line):
    untouched = editions.student(small_chapter(), set())
    cell_of(untouched, "one-answer").source = f"import os\n{line}\nroot_of_one = ..."
    return untouched


def nearly_empty():
    gone = solved_by_student()
    gone.cells = [cell for cell in gone.cells if cell.id.startswith("two")]
    return gone


def malformed():
    """Has cells that no editor writes."""
    notebook = json.loads(nbformat.writes(solved_by_student()))
    cells = {cell["id"]: cell for cell in notebook["cells"]}
    cells["one-answer"]["source"] = "root_of_one = '\0'"
    cells["two-answer"]["source"] = "raise ValueError(chr(0xD800))"
    cells["three-answer"]["metadata"] = {"nbgrader": 3, "tags": {"answer": 1}}
    cells["four-answer"]["source"] = ["root_of_four", " = 2"]
    cells["chapter"] |= {"id": [1], "metadata": None, "cell_type": None}
    cells["six-answer"]["source"] = LINES
    return json.dumps(notebook)


def with_magics():
    """Begins and answers with what only Jupyter understands, some of which no grader can do."""
    lines = ("%matplotlib inline", "%matplotlib widget\n!echo hello", "%%time", "%%unknown",
             "!false", "%config InlineBackend.rc = {}", "%load_ext unknown")  # fmt: skip
    notebook = solved_by_student(
        **{name: f"{line}\nroot_of_{name} = 2" for name, line in zip(ASKED, lines, strict=True)}
    )
    notebook.cells.insert(1, new_code_cell("%matplotlib notebook\n%unknown"))
    return notebook


TEXTS = {"broken": "{", "list": "[1]", "cells": '{"cells": 3}'}  # of no notebook


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """By student, the rows of a class whose notebooks are graded in one call."""
    place = tmp_path_factory.mktemp("class")
    return graded_in(
        place,
        edition_in(place),
        untouched=editions.student(small_chapter(), set()),
        half=half_solved(),
        perfect=solved_by_student(),
        renaming=renaming(),
        relying=relying(),
        editing=editing_checks(),
        popping=silencing('os.environ.pop("NMPCRL_STRICT", None)'),
        clearing=silencing("os.environ.clear()"),
        gone=nearly_empty(),
        malformed=malformed(),
        magics=with_magics(),
        long=solved_by_student(one='raise ValueError("much" * 100_000)'),
        **TEXTS,
    )


@pytest.mark.slow
def test_points_of_samples_and_a_sentence_for_each_loss(rows):
    assert points(rows["untouched"]) == expected(*POINTS)
    assert points(rows["half"]) == expected("1.2", "1.4", "1.5", "1.6", "1.7")
    assert points(rows["perfect"]) == expected()
    assert all("Not answered yet" in why for why in reasons(rows["untouched"]).values())
    assert set(reasons(rows["perfect"]).values()) == {""}
    assert rows["half"]["1.2"]["why"] == "16 is not right: it is too large."
    assert rows["half"]["1.4"]["why"].startswith("The check fails with NameError")
    project, total = rows["half"]["1.8"], rows["half"]["total"]
    assert (project["points"], project["of"]) == ("", "6")
    assert "rubric" in project["why"]
    assert (total["points"], total["of"]) == ("4", "28")


@pytest.mark.slow
def test_an_answer_that_hangs_ends_the_process_or_takes_memory_costs_its_own_points(graded):
    fatal = {
        "one": SLEEPS,
        "two": "import os\nos._exit(0)",
        "three": "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)",
        "four": GROWS,
        "six": "import sys\nsys.exit()",
    }
    limits = ("--cell-limit", "6", "--memory", "600")
    rows = graded(*limits, one=solved_by_student(**fatal))["one"]
    assert points(rows) == expected("1.1", "1.2", "1.3", "1.4", "1.6")
    said = reasons(rows)
    assert "a cell took longer than 6 s" in said["1.1"]
    assert "it ended the process" in said["1.2"]
    assert "it ended the process, with code -9" in said["1.3"]
    assert "it took more than 600 MB of memory" in said["1.4"]
    assert "SystemExit" in said["1.6"]


def test_other_meanings_of_names_and_a_folder_left_cost_no_points_elsewhere(rows):
    assert points(rows["renaming"]) == expected("1.1")


def test_magics_and_lines_for_a_shell_cost_no_points(rows):
    assert points(rows["magics"]) == expected()


def test_what_a_student_gave_another_meaning_keeps_it_where_an_answer_relies_on_it(rows):
    assert points(rows["relying"]) == expected("1.3")


def test_checks_that_are_edited_or_deleted_do_not_count(rows):
    assert points(rows["editing"]) == expected("1.2")


@pytest.mark.parametrize("student", ["popping", "clearing"])
def test_an_answer_that_silences_its_checks_gets_no_points_for_that(student, rows):
    assert points(rows[student]) == expected(*POINTS)


def test_cells_that_are_gone_and_files_that_are_no_notebook_are_rows_with_a_sentence(rows):
    assert points(rows["gone"]) == expected(*(set(POINTS) - {"1.2"}))
    assert rows["gone"]["1.1"]["why"] == "The answer cell is missing."
    for name in TEXTS:
        assert points(rows[name]) == expected(*POINTS)
        assert rows[name]["1.1"]["why"] == "The file is no notebook."


def test_cells_that_no_editor_writes_cost_no_more_than_their_points(rows):
    lost = rows["malformed"]
    assert points(lost) == expected("1.1", "1.2", "1.6")  # the last writes where it should not
    assert lost["1.2"]["why"] == "The answer fails with ValueError: ?"


def test_a_long_message_does_not_fill_the_table(rows):
    assert len(rows["long"]["1.1"]["why"]) < 2000


def test_a_notebook_whose_name_is_that_of_no_chapter_is_a_row_with_a_sentence(graded):
    rows = graded(name="holidays", one=solved_by_student())["one"]
    assert rows[""]["why"] == "The name of the file does not end in that of a chapter."


@pytest.mark.parametrize("place", ["nothing", "empty"])
def test_a_folder_that_is_not_what_it_should_be_is_one_sentence(place, tmp_path, edition):
    (tmp_path / "empty").mkdir()
    out = ["--out", str(tmp_path / "grades.csv")]
    for folder, of in ((place, edition), ("edition", tmp_path / place)):
        words = ["grade", str(tmp_path / folder), *out, "--edition", str(of)]
        refused = CliRunner().invoke(main, words)
        assert refused.exit_code
        assert "Traceback" not in refused.output
        assert refused.output.count("Error: ") == 1


def test_a_chapter_that_fails_without_any_answer_is_refused_before_one_is_graded(edition, tmp_path):
    place = edition / f"source/{SMALL}/{SMALL}.ipynb"
    place.write_text(place.read_text().replace("four = 4.0", "four = 1 / 0"))
    (tmp_path / "in").mkdir()
    nbformat.write(solved_by_student(), tmp_path / f"in/{SMALL}.ipynb")
    with pytest.raises(CannotGrade, match="01_small itself fails with ZeroDivisionError"):
        list(grade(tmp_path / "in", edition, Limits()))


def test_what_a_chapter_trains_is_there_for_every_notebook(edition, tmp_path):
    once = "from pathlib import Path\nassert not (new := Path('data/new')).exists()\nnew.touch()"
    (chapter,) = chapters(edition)
    cell_of(chapter.notebook, "between-1")["source"] = once
    with closing(Judge(chapter, Limits(), tmp_path / "ready")) as judge:
        ready = {path.name for path in judge.chapter.data.iterdir()}
    assert ready == {
        "new",
        "of_the_chapter.txt",
        "published",
    }
    assert not (edition / "data/new").exists()


def test_an_edition_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(CannotGrade, match="make course"):
        chapters(tmp_path)


def test_a_table_never_computes_what_a_student_calls_a_folder():
    assert cell("\x1b]0;anna\x07") == "?]0;anna?"
    assert [cell(one) for one in ("=1+1", "+1", "@x", "-1", "anna", 3)] == [
        "'=1+1",
        "'+1",
        "'@x",
        "'-1",
        "anna",
        3,
    ]


def test_what_an_earlier_call_graded_stays_if_this_one_cannot_begin(tmp_path, edition):
    out = tmp_path / "grades.csv"
    out.write_text("known")
    (tmp_path / "in").mkdir()
    words = ["grade", str(tmp_path / "in"), "--out", str(out), "--edition", str(edition)]
    refused = CliRunner().invoke(main, words)
    assert "has no notebook" in refused.output
    assert out.read_text() == "known"


def test_an_earlier_table_stays_until_a_notebook_is_graded(tmp_path, edition, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr(grading, "grade", interrupted)
    out = tmp_path / "grades.csv"
    out.write_text("known")
    words = ["grade", str(tmp_path), "--out", str(out), "--edition", str(edition)]
    assert CliRunner().invoke(main, words).exit_code == 1
    assert out.read_text() == "known"


@pytest.mark.parametrize(
    "added",
    ["-Copy1", " (2)", "(2)", " - Copy", " - Copy (2)", " copy", " copy 2", "-Copy1-Copy2", ""],
)
def test_what_is_added_to_the_name_of_a_copy_does_not_matter(added):
    assert grading._stem(Path(f"anna_{SMALL}{added}.ipynb")) == f"anna_{SMALL}"


@pytest.mark.slow
def test_copies_and_files_that_windows_wrote_are_graded(tmp_path, edition):
    for name, mark in ((f"anna_{SMALL}-Copy1", ""), (f"ben_{SMALL} (2)", "\ufeff")):
        (tmp_path / "in").mkdir(exist_ok=True)
        text = mark + nbformat.writes(solved_by_student())
        (tmp_path / f"in/{name}.ipynb").write_text(text, "utf-8")
    found = list(grade(tmp_path / "in", edition, Limits(), workers=2))
    assert [marks[0].student for marks in found] == ["anna", "ben"]
    for marks in found:
        assert {mark.points == mark.of for mark in marks if mark.points is not None} == {True}


BESIDE = """from math import comb
import numpy as np
from scipy.stats import fisher_exact"""  # what solutions take from their chapters
OBJECTS = {"1.2", "2.2", "2.5", "8.3"}  # exercises whose checks take what a chapter computed


@pytest.mark.slow
@pytest.mark.weekly
@pytest.mark.parametrize("name", course.chapters())
def test_every_solution_is_right_although_nothing_but_plain_values_pass(name, tmp_path):
    source = course.chapters()[name]
    kept = {"exercises-checks"}
    for one in exercises(source):
        if one.parts["check"] and one.number not in OBJECTS:
            kept |= {cell.id for cell in chain([one.text], *one.parts.values())}
    source.cells = [cell for cell in source.cells if cell.id in kept]
    source.cells[:0] = [new_markdown_cell("# Exercises"), new_code_cell(BESIDE)]
    place = tmp_path / "edition/source" / name.removesuffix(".ipynb")
    place.mkdir(parents=True)
    (tmp_path / "edition/data/published").mkdir(parents=True)
    nbformat.write(editions.grader(source, set()), place / name)
    (tmp_path / "in").mkdir()
    nbformat.write(solved(source), tmp_path / "in" / name)
    (marks,) = grade(tmp_path / "in", tmp_path / "edition", Limits())
    assert {mark.exercise: mark.why for mark in marks if mark.points != mark.of} == {}
