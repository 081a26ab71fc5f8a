"""The editions for a course: what students get, what teachers get, and that both run."""

import ast
import re
import zipfile
from pathlib import Path

import course
import nbformat
import pytest
from nbclient import NotebookClient

from nmpcrl.course.exercises import exercises, solved

ROOT = Path(__file__).resolve().parents[2]
SOURCES = course.chapters()
PAGES = set(SOURCES)
WHEEL = "nmpcrl.whl"

each_chapter = pytest.mark.parametrize("name", SOURCES)


def made(edition: str, name: str):
    return course.EDITIONS[edition](SOURCES[name], PAGES, WHEEL)


def text(notebook) -> str:
    """Everything in a notebook's file."""
    return nbformat.writes(notebook)


def statements(code: str) -> set[str]:
    """The statements of a code without its comments and layout, those within others, too."""
    lines = {ast.unparse(node) for node in ast.walk(ast.parse(code)) if isinstance(node, ast.stmt)}
    return {line for line in lines if "\n" not in line}


@each_chapter
def test_no_file_of_the_students_holds_the_code_of_a_solution(name):
    notebook = made("student", name)
    code = [cell.source for cell in notebook.cells if cell.cell_type == "code"]
    there = set().union(*map(statements, code))
    prose = re.sub(r"\s", "", text(notebook))
    for one in exercises(SOURCES[name]):
        for answer, cell in zip(one.answers, one.parts["answer"], strict=True):
            new = statements(answer) - statements(cell.source)
            assert new, one.number
            assert not new & there, one.number
            for line in new:
                assert re.sub(r"\s", "", line) not in prose, one.number


@each_chapter
def test_no_file_of_the_students_holds_the_number_or_the_words_of_a_solution(name):
    notebook = made("student", name)
    kept = list(exercises(notebook))
    assert not any(one.parts["solution"] for one in kept)
    assert "Solution</summary>" not in text(notebook)
    asked = "\n".join(cell.source for one in kept for cell in cells_of(one))
    for one in exercises(SOURCES[name]):
        for value in filter(None, map(value_of, one.answers)):
            assert not re.search(rf"(?<![\d.]){re.escape(value)}(?![\d.])", asked), one.number
        (solution,) = one.parts["solution"]
        for paragraph in solution.source.split("\n\n"):
            if len(paragraph) > 40:
                assert paragraph not in "\n\n".join(cell.source for cell in notebook.cells)


def cells_of(one) -> list:
    return [one.text, *(cell for cells in one.parts.values() for cell in cells)]


def value_of(code: str) -> str:
    """The number that an answer computes, if its digits would give it away."""
    found = re.fullmatch(r"\w+ = ([\d\s.()*/+e-]+)", code)
    value = f"{eval(found[1]):.4g}" if found else ""
    return value if len(value.replace(".", "")) > 2 else ""


@each_chapter
def test_a_student_sees_what_an_exercise_asks_for_and_cannot_delete_its_check(name):
    notebook = made("student", name)
    for one, source in zip(exercises(notebook), exercises(SOURCES[name]), strict=True):
        assert f"*{source.about.line}*" in one.text.source
        assert one.about.mistakes == ()
        assert [c.source for c in one.parts["answer"]] == [c.source for c in source.parts["answer"]]
        for cell in one.parts["check"]:
            assert not cell.metadata.deletable
            assert not cell.metadata.editable


@each_chapter
def test_teachers_get_the_solutions_a_table_and_what_goes_wrong(name):
    notebook = made("instructor", name)
    answered = solved(SOURCES[name])
    for one, source in zip(exercises(notebook), exercises(answered), strict=True):
        assert [c.source for c in one.parts["answer"]] == [c.source for c in source.parts["answer"]]
        for mistake in source.about.mistakes:
            assert f"- Common: {mistake}" in text(notebook).replace('\\"', '"')
    table = notebook.cells[3].source
    every = list(exercises(answered))
    assert table.count("\n| ") == len(every) + 1
    assert f"Together {sum(one.about.minutes for one in every)} minutes" in table


@each_chapter
@pytest.mark.parametrize("edition", course.EDITIONS)
def test_an_edition_is_a_valid_notebook_that_leads_nowhere_else(edition, name):
    notebook = made(edition, name)
    nbformat.validate(notebook)
    ids = [cell.id for cell in notebook.cells]
    assert len(set(ids)) == len(ids)
    linked = re.findall(r"\]\(([\w.-]+\.(?:ipynb|md))", text(notebook))
    assert set(linked) <= PAGES
    assert all(not cell.get("outputs") for cell in notebook.cells)
    parameters = next(c for c in notebook.cells if "parameters" in c.metadata.get("tags", []))
    if "study" in parameters.source:
        assert 'study = "published"' in parameters.source
    (box,) = (cell for cell in notebook.cells if "try" in cell.metadata.get("tags", []))
    assert f"papermill {name} out.ipynb" in box.source
    assert "make " not in box.source
    assert "book/" not in box.source


@pytest.mark.slow
def test_two_builds_give_the_same_bytes(tmp_path):
    for build in ("one", "two"):
        for edition in course.EDITIONS:
            course.edition(edition, tmp_path / build / edition)
    files = {
        path.relative_to(tmp_path / "one"): path.read_bytes()
        for path in sorted((tmp_path / "one").rglob("*"))
        if path.is_file()
    }
    again = {path: (tmp_path / "two" / path).read_bytes() for path in files}
    assert files == again
    assert {path.parts[0] for path in files} == set(course.EDITIONS)
    assert not any(b"/" + b"work/" in data or str(ROOT).encode() in data for data in files.values())


def executed(edition: str, name: str, folder: Path, monkeypatch):
    """An edition of a chapter, run from its own folder, with its own wheel.

    Runs that are stored in this checkout are not trained.
    """
    stored = ROOT / "runs"
    for variable in ("NMPCRL_RUNS", "NMPCRL_PUBLISHED", "NMPCRL_STRICT"):
        monkeypatch.delenv(variable, raising=False)
    course.edition(edition, folder)
    if stored.is_dir():
        (folder / "data/runs").symlink_to(stored)
    zipfile.ZipFile(next(folder.glob("*.whl"))).extractall(folder.parent / "installed")
    monkeypatch.setenv("PYTHONPATH", str(folder.parent / "installed"))
    notebook = nbformat.read(folder / name, 4)
    place = {"metadata": {"path": str(folder)}}
    return NotebookClient(notebook, timeout=900, resources=place).execute()


def failed(notebook) -> list[str]:
    """The cells that ended in an error."""
    kinds = {
        cell.id: [out.output_type for out in cell.outputs]
        for cell in notebook.cells
        if cell.cell_type == "code"
    }
    return [name for name, outputs in kinds.items() if "error" in outputs]


@pytest.mark.course
@each_chapter
def test_an_untouched_notebook_of_a_student_runs_and_fails_exactly_its_checks(
    name, tmp_path, monkeypatch
):
    notebook = executed("student", name, tmp_path / "student", monkeypatch)
    checks = [c.id for one in exercises(notebook) for c in one.parts["check"]]
    assert failed(notebook) == checks


@pytest.mark.course
@each_chapter
def test_every_check_passes_in_the_notebook_of_a_teacher(name, tmp_path, monkeypatch):
    notebook = executed("instructor", name, tmp_path / "instructor", monkeypatch)
    assert failed(notebook) == []
    for one in exercises(notebook):
        for cell in one.parts["check"]:
            assert cell.outputs[0].data["text/plain"].startswith("Right"), one.number
