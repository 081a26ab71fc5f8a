"""Grading: what students hand in, run as strangers' code that hangs, ends or cheats."""

import csv
import json
import os
import shutil
import subprocess
import sys
from itertools import chain
from pathlib import Path

import course
import nbformat
import pytest
from click.testing import CliRunner
from nbformat.v4 import new_code_cell

from nmpcrl.commands import main
from nmpcrl.course.confined import Limits, run
from nmpcrl.course.exercises import exercises
from nmpcrl.course.submissions import CannotGrade, chapters, notebook_of, taken

CHAPTER = "01_mdp_and_nmpc"
SOURCE = course.chapters()[f"{CHAPTER}.ipynb"]
EVERY = list(exercises(SOURCE))
CHECKED = [one for one in EVERY if one.parts["check"]]
POINTS = {one.number: one.about.points for one in CHECKED}
HALF = EVERY[:3]  # of which the sample "half" has the answers
NBGRADER = os.environ.get("NMPCRL_NBGRADER", "")


def made(edition: str):
    return course.EDITIONS[edition](SOURCE, {f"{CHAPTER}.ipynb"}, "nmpcrl.whl")


def sample(answered=()):
    """A student's notebook with the answers of some exercises."""
    notebook = tiny(made("student"))
    right = {cell.id: code for one in answered for cell, code in _answers(one)}
    for cell in notebook.cells:
        cell.source = right.get(cell.id, cell.source)
    return notebook


def _answers(one):
    return zip(one.parts["answer"], one.answers, strict=True)


def cell_of(notebook, name):
    return next(cell for cell in notebook.cells if cell.id == name)


def tiny(notebook):
    """Without the chapter: setup, checks and exercises are all that most behaviour needs."""
    kept = {"setup", "check", "exercises-checks"}  # the cell "check" makes the task and the NMPC
    for one in exercises(notebook):
        kept |= {cell.id for cell in (one.text, *chain.from_iterable(one.parts.values()))}
    kept |= {c.id for c in notebook.cells if "parameters" in c.metadata.get("tags", [])}
    notebook.cells = [cell for cell in notebook.cells if cell.id in kept]
    return notebook


@pytest.fixture
def edition(tmp_path) -> Path:
    place = tmp_path / "edition/source/nmpcrl"
    place.mkdir(parents=True)
    nbformat.write(tiny(made("grader")), place / f"{CHAPTER}.ipynb")
    return tmp_path / "edition"


@pytest.fixture
def graded(tmp_path, edition):
    """Rows of the CSV file by exercise, of notebooks that are handed in; by student if many."""

    def grade(*words, **handed):
        for student, notebook in handed.items():
            place = tmp_path / "in" / student / f"{CHAPTER}.ipynb"
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


def points(rows) -> dict[str, int]:
    return {number: int(row["points"]) for number, row in rows.items() if row["points"]}


def expected(*lost: str) -> dict[str, int]:
    return {number: 0 if number in lost else of for number, of in POINTS.items()}


@pytest.mark.slow
def test_points_of_the_samples_and_a_sentence_for_each_loss(graded):
    rows = graded(untouched=sample(), half=sample(HALF), perfect=sample(CHECKED))
    assert points(rows["untouched"]) == expected(*POINTS)
    assert points(rows["half"]) == expected(*(one.number for one in CHECKED[3:]))
    assert points(rows["perfect"]) == expected()
    assert "Not answered yet" in rows["untouched"]["1.1"]["why"]
    assert [row["why"] for row in rows["perfect"].values() if row["points"]] == [""] * len(POINTS)
    (project,) = (row for row in rows["perfect"].values() if not row["points"])
    assert "rubric" in project["why"]
    assert project["of"] == "6"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ("while True:\n    pass", "longer than 40 s"),
        ("import os\nos._exit(0)", "ended the process"),
        ("import os, signal\nos.kill(os.getpid(), signal.SIGKILL)", "ended the process, with code"),
    ],
)
def test_an_answer_that_hangs_or_ends_the_process_costs_its_own_points(graded, answer, said):
    notebook = sample(CHECKED)
    cell_of(notebook, "ex-reach-answer").source = answer
    rows = graded("--time-limit", "40", one=notebook)["one"]
    assert points(rows) == expected("1.3")
    assert said in rows["1.3"]["why"]


@pytest.mark.slow
def test_a_notebook_that_takes_memory_is_stopped_where_it_does(graded):
    notebook = sample(CHECKED)
    cell_of(notebook, "ex-reach-answer").source = "longest = bytearray(10**11)"
    rows = graded(one=notebook)["one"]
    assert points(rows) == expected("1.3")
    assert "Memory" in rows["1.3"]["why"] or "memory" in rows["1.3"]["why"]


@pytest.mark.slow
def test_checks_that_are_edited_or_deleted_and_what_stands_for_them_do_not_count(graded):
    edited = sample()
    for one in exercises(edited):
        for cell in one.parts["check"]:
            cell.source = "'Right.'"
    edited.cells.append(new_code_cell("class check:\n    distance = print"))
    strict = cell_of(edited, "setup")
    strict.source = strict.source.replace('"1"', '""')
    deleted = sample(HALF)
    for one in list(exercises(deleted)):
        for cell in one.parts["check"]:
            deleted.cells.remove(cell)
    rebound = sample(HALF)
    cell_of(rebound, "ex-apart-answer").source = "check = print\nreason = 'c'"
    rows = graded(edited=edited, deleted=deleted, rebound=rebound)
    assert points(rows["edited"]) == expected(*POINTS)
    assert points(rows["deleted"]) == points(rows["rebound"]) | {"1.4": 0}
    assert points(rows["rebound"])["1.4"] == POINTS["1.4"]


@pytest.mark.slow
def test_cells_that_are_gone_and_files_that_are_no_notebook_are_rows_with_a_sentence(graded):
    gone = sample(CHECKED)
    gone.cells = [cell for cell in gone.cells if cell.id.startswith("ex-scale")]
    texts = {"broken": "{", "list": "[1]", "cells": '{"cells": 3}'}
    rows = graded(gone=gone, **texts)
    assert points(rows["gone"]) == expected(*(set(POINTS) - {"1.2"}))
    assert rows["gone"]["1.1"]["why"] == "The answer cell is missing."
    for name in texts:
        assert points(rows[name]) == expected(*POINTS)
        assert rows[name]["1.1"]["why"] == "The file is no notebook."


def test_files_are_written_in_a_folder_that_is_thrown_away(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = "from pathlib import Path\nPath('left.txt').write_text(str(Path.cwd()))\nPath.cwd()"
    sat = run([("writes", code), ("next", "1 / 0")], None, Limits(60))
    assert sat.ends["writes"]["error"] is None
    assert sat.ends["next"]["error"][0] == "ZeroDivisionError"
    assert list(tmp_path.iterdir()) == []


def steps(notebook, edition):
    (chapter,) = chapters(edition)
    path = edition / "handed-in.ipynb"
    path.write_text(nbformat.writes(notebook))
    return taken(chapter, notebook_of(path)).steps


def test_added_cells_stay_behind_the_cell_that_they_followed(edition):
    notebook = sample()
    at = notebook.cells.index(cell_of(notebook, "ex-scale-hint-1"))
    notebook.cells.insert(at + 1, new_code_cell("power = 2", id="own"))
    every = steps(notebook, edition)
    (own,) = (k for k, step in enumerate(every) if step.theirs)
    assert every[own].code == "power = 2"
    assert (every[own].exercise, every[own + 1].name) == ("mdp-scale", "ex-scale-answer")


def test_an_answer_is_found_by_its_exercise_where_an_editor_has_renamed_the_cells(edition):
    notebook = sample(HALF)
    for k, cell in enumerate(notebook.cells):
        cell.id = f"other-{k}"
    by_exercise = {s.name: s.code for s in steps(notebook, edition)}
    (code,) = HALF[0].answers
    assert by_exercise["ex-distance-answer"] == code


def test_the_edition_for_graders_runs_without_its_solutions(edition):
    (chapter,) = chapters(edition)
    code = "\n".join(cell.source for cell in chapter.notebook.cells)
    assert "SOLUTION" not in code
    assert HALF[0].answers[0] not in code


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


def test_an_edition_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(CannotGrade, match="make course"):
        chapters(tmp_path)


def test_otter_gets_a_question_around_each_exercise_with_a_check():
    notebook = course.EDITIONS["grader"](SOURCE, set(), "nmpcrl.whl", otter=True)
    nbformat.validate(notebook)
    raw = [cell.source for cell in notebook.cells if cell.cell_type == "raw"]
    words = [source.splitlines()[0].removeprefix("# ") for source in raw[1:]]
    pairs = ("QUESTION", "SOLUTION", "SOLUTION", "TESTS", "TESTS", "QUESTION")
    order = [
        f"{way} {word}"
        for way, word in zip(("BEGIN", "BEGIN", "END") * 2, pairs, strict=True)
        if word
    ]
    order[3:] = ["BEGIN TESTS", "END TESTS", "END QUESTION"]
    assert words == order * len(CHECKED)
    assert f"name: {CHECKED[0].name}\npoints: 1" in raw[1]


@pytest.mark.slow
@pytest.mark.skipif(not NBGRADER, reason="NMPCRL_NBGRADER names no Python that has nbgrader")
def test_nbgrader_gives_the_same_points(tmp_path, edition, graded):
    place = edition / "source/nmpcrl"
    (edition / "nbgrader_config.py").write_text(course.autograded.NBGRADER_CONFIG)
    samples = {"untouched": (), "half": HALF, "perfect": CHECKED}
    _nbgrader(edition, "generate_assignment", "nmpcrl")
    released = edition / "release/nmpcrl" / f"{CHAPTER}.ipynb"
    assert "SOLUTION" not in released.read_text()
    assert "MARK SCHEME" not in released.read_text()
    handed = {}
    for student, answered in samples.items():
        notebook = nbformat.read(released, 4)
        for one in answered:
            for cell, code in _answers(one):
                cell_of(notebook, cell.id).source = code
        to = edition / "submitted" / student / "nmpcrl"
        shutil.copytree(place, to)
        nbformat.write(notebook, to / f"{CHAPTER}.ipynb")
        handed[student] = notebook
    _nbgrader(edition, "autograde", "nmpcrl")
    _nbgrader(edition, "export", "--to", str(tmp_path / "theirs.csv"))
    with (tmp_path / "theirs.csv").open(newline="") as file:
        theirs = {row["student_id"]: float(row["raw_score"]) for row in csv.DictReader(file)}
    shutil.rmtree(edition / "release")
    shutil.rmtree(edition / "submitted")
    shutil.rmtree(edition / "autograded")
    ours = {name: sum(points(rows).values()) for name, rows in graded(**handed).items()}
    assert theirs == ours


def _nbgrader(folder: Path, *words: str) -> None:
    """Call nbgrader; its kernel is this Python, which has the library."""
    kernel = folder / "jupyter/kernels/python3"
    kernel.mkdir(parents=True, exist_ok=True)
    argv = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    (kernel / "kernel.json").write_text(
        json.dumps({"argv": argv, "display_name": "Python 3", "language": "python"})
    )
    own = {"JUPYTER_PATH": str(folder / "jupyter"), "NMPCRL_STRICT": "1"}
    done = subprocess.run(
        [NBGRADER, "-m", "nbgrader", *words],
        cwd=folder,
        env=os.environ | own,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-3000:]
