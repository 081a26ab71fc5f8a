"""The editions for a course: what students get, what teachers get, and that both run."""

import ast
import math
import re
import zipfile
from base64 import b64encode
from importlib.metadata import distributions, requires
from pathlib import Path

import nbformat
import pytest
from click.testing import CliRunner
from driver.course import course, editions, handout
from driver.teaching import plans, syllabus
from driver.teaching.declared import declared
from nbclient import NotebookClient
from nbformat.v4 import new_code_cell, new_notebook, new_output
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from nmpcrl.course import variants
from nmpcrl.course.exercises import exercises, solved
from nmpcrl.report.figures.sheet import MIME

ROOT = Path(__file__).resolve().parents[2]
SOURCES = course.chapters()
PAGES = set(SOURCES)

each_chapter = pytest.mark.parametrize("name", SOURCES)


def made(edition: str, name: str):
    return course.EDITIONS[edition](SOURCES[name], PAGES)


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
    (table,) = (cell.source for cell in notebook.cells if cell.id == "exercises-table")
    every = list(exercises(answered))
    assert table.count("\n| ") == len(every) + 1
    assert f"Together {sum(one.about.minutes for one in every)} minutes" in table


@each_chapter
def test_teachers_get_the_minutes_of_each_section(name):
    (table,) = (c.source for c in made("instructor", name).cells if c.id == "sections-table")
    rows = [row.strip("| ").split(" | ") for row in table.splitlines() if row.startswith("| ")][1:]
    chapter = syllabus.chapters()[Path(name).stem]
    assert [row[0] for row in rows] == [*(one.title for one in chapter.sections), "Together"]
    assert int(rows[-1][1]) == chapter.reading
    for one, row in zip(chapter.sections, rows, strict=False):
        assert int(row[1]) == syllabus.minutes([one])
        assert int(row[2]) == math.ceil(plans.PACE * int(row[1]))
        assert row[3:] == ([str(plans.LIVE * one.live)] if one.live else [])


@each_chapter
def test_a_note_before_each_live_figure_says_to_teachers_where_it_helps(name):
    cells = made("instructor", name).cells
    figures = [k for k, cell in enumerate(cells) if syllabus.LIVE.search(cell.source)]
    assert len(figures) == sum(one.live for one in syllabus.chapters()[Path(name).stem].sections)
    for k in figures:
        said = declared().live[cells[k].id]
        assert cells[k - 1].source == f"> **For the teacher.** {said}"
        assert said.endswith(".")


def test_the_syllabus_says_where_a_live_figure_helps_for_those_that_there_are():
    every = {cell.id for notebook in SOURCES.values() for cell in notebook.cells}
    assert set(declared().live) <= every
    with pytest.raises(syllabus.Unknown, match="new-live"):
        declared().helps("new-live")


WHEEL = "nmpcrl-0.1.0-py3-none-any.whl"


def test_an_edition_installs_what_it_needs_and_nothing_that_tests_or_builds():
    lines = handout.requirements(WHEEL).splitlines()
    names = {re.match(r"[\w.-]+", line)[0] for line in lines if line[0] not in "#-."}
    assert {"casadi", "torch", "ipykernel", "papermill", "jupyterlab", "psutil"} <= names
    assert not {"pytest", "ruff", "mypy", "sphinx", "jupyter-book", "mpcrl", "dask"} & names
    assert f"./{WHEEL}" in lines
    assert handout.CPU in lines
    pinned = set((ROOT / "environment.txt").read_text().splitlines())
    assert {line for line in lines if line[0] not in "#-."} - pinned == {
        line for line in lines if line.startswith("jupyterlab==")
    }


def test_what_an_edition_installs_is_all_that_it_brings():
    """Nothing that is installed here and asked for by one of these is left out."""
    names = set(handout.pins(ROOT / "environment.txt"))
    lines = handout.requirements(WHEEL).splitlines()
    chosen = {canonicalize_name(re.match(r"[\w.-]+", line)[0]) for line in lines[2:-1]}
    for one in chosen & names:
        for asked in map(Requirement, requires(one) or ()) if one in INSTALLED else ():
            if not asked.marker or asked.marker.evaluate({"extra": ""}):
                assert canonicalize_name(asked.name) in chosen, (one, asked.name)


INSTALLED = {canonicalize_name(one.metadata["Name"]) for one in distributions()}


@pytest.mark.parametrize("edition", course.EDITIONS)
def test_an_edition_says_how_it_is_installed_on_three_systems(edition):
    said = handout.readme(edition, WHEEL, "01_mdp_and_nmpc.ipynb")
    for part in ("Windows", "macOS and Linux", "Python 3.11 to 3.14", WHEEL, "requirements.txt"):
        assert part in said
    assert ("solutions" in said) == (edition != "student")


def test_an_edition_without_its_data_says_so_and_trains_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileNotFoundError, match="no folder `data` here"):
        exec(editions.SETUP, {})


@pytest.fixture
def last_build(tmp_path, monkeypatch) -> Path:
    """An executed chapter with one figure."""
    shown = {"wide": {"svg": "<svg/>"}, "pdf": b64encode(b"%PDF").decode()}
    data = {"image/png": b64encode(b"PNG").decode(), MIME: shown}
    cell = new_code_cell("draw()", id="loop", outputs=[new_output("display_data", data)])
    nbformat.write(new_notebook(cells=[cell]), tmp_path / "01_a.ipynb")
    monkeypatch.setattr(course.slides, "EXECUTED", tmp_path)
    return tmp_path


def test_teachers_get_the_figures_of_the_last_build_as_svg_and_pdf(last_build):
    course.figures(["01_a.ipynb"], last_build / "figures")
    place = last_build / "figures/01_a"
    assert (place / "loop.svg").read_text() == "<svg/>"
    assert (place / "loop.pdf").read_bytes() == b"%PDF"


def test_without_an_executed_chapter_the_figures_are_not_whole_and_the_reason_is_said(
    last_build, monkeypatch, capsys
):
    monkeypatch.setattr(course, "PLACE", last_build)
    assert not course.is_whole("instructor/figures", {"02_b.ipynb": None})
    assert "`make book`" in capsys.readouterr().out
    notebook = nbformat.read(last_build / "01_a.ipynb", 4)
    del notebook.cells[0].outputs[0].data[MIME]["pdf"]  # an older build
    nbformat.write(notebook, last_build / "01_a.ipynb")
    assert not course.is_whole("instructor/figures", {"01_a.ipynb": None})


@pytest.mark.parametrize(("whole", "code"), [(True, 0), (False, 1)])
def test_whoever_makes_a_course_without_a_built_book_is_told_by_the_exit_code_too(
    whole, code, tmp_path, monkeypatch
):
    monkeypatch.setattr(course, "PLACE", tmp_path)
    monkeypatch.setattr(course, "SITE", tmp_path)
    monkeypatch.setattr(course, "EDITIONS", {})
    monkeypatch.setattr(course.offline, "stored", lambda sources: {})
    monkeypatch.setattr(course, "is_whole", lambda name, sources: whole)
    assert CliRunner().invoke(course.main).exit_code == code


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
    (tmp_path / "run.npz").write_bytes(bytes(9))
    runs = {"data/runs/run.npz": tmp_path / "run.npz"}
    for build in ("one", "two"):
        course.wheel.cache_clear()
        for edition in course.EDITIONS:
            course.edition(edition, tmp_path / build / edition, runs)
    files = {
        path.relative_to(tmp_path / "one"): path.read_bytes()
        for path in sorted((tmp_path / "one").rglob("*"))
        if path.is_file()
    }
    again = {path: (tmp_path / "two" / path).read_bytes() for path in files}
    assert files == again
    assert {path.parts[0] for path in files} == set(course.EDITIONS)
    assert all(Path(edition, *runs) in files for edition in course.EDITIONS)
    assert not any(b"/" + b"work/" in data or str(ROOT).encode() in data for data in files.values())


@pytest.mark.slow
def test_with_a_secret_students_get_neither_an_answer_that_counts_nor_its_check(tmp_path):
    secret = b"\x00\xffa secret"
    course.edition("student", tmp_path / "student", {}, secret=secret)
    (wheel,) = (tmp_path / "student").glob("*.whl")
    files = zipfile.ZipFile(wheel)
    library = "".join(files.read(name).decode() for name in files.namelist() if "checks" in name)
    others = 0
    for name, source in SOURCES.items():
        mine = nbformat.read(tmp_path / "student" / name, 4)
        solutions = {one.name: one for one in exercises(variants.varied(source, secret))}
        for one in exercises(mine):
            if not one.parts["check"] or not one.about.counts:
                continue
            others += 1
            (check,) = solutions[one.name].parts["check"]
            called = check.source.removeprefix("check.").partition("(")[0]
            assert f"def {called}(answer: Any, *" not in library
            assert [cell.source for cell in one.parts["check"]] == [variants.LATER]
            asked = "\n".join(cell.source for cell in cells_of(one))
            for value in filter(None, map(value_of, solutions[one.name].answers)):
                assert not re.search(rf"(?<![\d.]){re.escape(value)}(?![\d.])", asked)
    assert others
    assert secret not in b"".join(p.read_bytes() for p in tmp_path.rglob("*") if p.is_file())


def test_a_secret_that_is_empty_is_refused(tmp_path):
    (tmp_path / "secret").touch()
    refused = CliRunner().invoke(course.main, ["--secret", str(tmp_path / "secret")])
    assert "The file is empty" in refused.output


@pytest.fixture
def executed(edition_of_course, tmp_path, monkeypatch):
    """Runs a chapter of an edition from its own folder, with its own wheel and runs."""

    def run(edition: str, name: str):
        for variable in ("NMPCRL_RUNS", "NMPCRL_PUBLISHED", "NMPCRL_STRICT"):
            monkeypatch.delenv(variable, raising=False)
        folder = edition_of_course(edition)
        zipfile.ZipFile(next(folder.glob("*.whl"))).extractall(tmp_path / "installed")
        monkeypatch.setenv("PYTHONPATH", str(tmp_path / "installed"))
        notebook = nbformat.read(folder / name, 4)
        place = {"metadata": {"path": str(folder)}}
        return NotebookClient(notebook, timeout=900, resources=place).execute()

    return run


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
def test_an_untouched_notebook_of_a_student_runs_and_fails_exactly_its_checks(name, executed):
    notebook = executed("student", name)
    checks = [c.id for one in exercises(notebook) for c in one.parts["check"]]
    assert failed(notebook) == checks


@pytest.mark.course
@each_chapter
def test_every_check_passes_in_the_notebook_of_a_teacher(name, executed):
    notebook = executed("instructor", name)
    assert failed(notebook) == []
    for one in exercises(notebook):
        for cell in one.parts["check"]:
            assert cell.outputs[0].data["text/plain"].startswith("Right"), one.number
