"""What keeps the chapters thin and teachable."""

import ast
import re
import shlex
from pathlib import Path

import build
import nbformat
import pytest
from papermill.cli import papermill

ROOT = Path(__file__).resolve().parents[2]
PATHS = sorted((ROOT / "book").glob("*.ipynb"))
NOTEBOOKS = {path.stem: nbformat.read(path, as_version=4) for path in PATHS}
CHAPTERS = [name for name in NOTEBOOKS if re.match(r"\d\d_|solver", name)]

each_notebook = pytest.mark.parametrize("name", NOTEBOOKS)
each_chapter = pytest.mark.parametrize("name", CHAPTERS)


def code(name: str) -> list:
    return [cell for cell in NOTEBOOKS[name].cells if cell.cell_type == "code"]


def prose(name: str) -> str:
    return "\n\n".join(
        cell.source for cell in NOTEBOOKS[name].cells if cell.cell_type == "markdown"
    )


def tags(cell) -> list[str]:
    return cell.metadata.get("tags", [])


def figures(name: str) -> list:
    return [cell for cell in code(name) if "figure" in cell.metadata.get("mystnb", {})]


def test_the_chapters_are_there_and_in_the_table_of_contents():
    *numbered, last = CHAPTERS
    assert [name[:2] for name in numbered] == [f"{i:02}" for i in range(1, len(numbered) + 1)]
    assert len(numbered) >= 7
    assert last == "solver"
    assert set(NOTEBOOKS) == set(build.notebooks())


@each_notebook
def test_a_notebook_is_valid_and_runs_on_the_kernel_python3(name):
    nbformat.validate(NOTEBOOKS[name])
    kernel = NOTEBOOKS[name].metadata.kernelspec
    assert (kernel.name, kernel.language) == ("python3", "python")


@each_notebook
def test_nothing_that_a_run_produces_is_stored(name):
    for cell in code(name):
        assert not cell.outputs
        assert cell.execution_count is None


@each_notebook
def test_a_cell_has_at_most_20_lines_of_plain_python(name):
    for cell in code(name):
        ast.parse(cell.source)
        assert len(cell.source.splitlines()) <= 20, cell.source


@each_notebook
def test_definitions_are_short_and_there_is_no_class(name):
    for cell in code(name):
        for node in ast.walk(ast.parse(cell.source)):
            assert not isinstance(node, ast.ClassDef), cell.source
            if isinstance(node, ast.FunctionDef):
                assert node.end_lineno - node.lineno < 8, cell.source


@each_notebook
def test_figures_hide_their_code_and_have_a_name_a_caption_and_alt_text(name):
    for cell in figures(name):
        figure, image = cell.metadata.mystnb.figure, cell.metadata.mystnb.get("image", {})
        assert "hide-input" in tags(cell), cell.source
        assert figure.name.startswith("fig:")
        assert figure.caption.strip().endswith(".")
        assert image.get("alt", "").strip(), cell.source


def test_every_label_is_used_once():
    pages = [prose(name) for name in NOTEBOOKS]
    pages += [path.read_text() for path in sorted((ROOT / "book").glob("*.md"))]
    text = "\n".join(pages)
    labels = re.findall(r"^:label: (\S+)$|^\((\S+)\)=$|\$\$ \((\S+)\)$", text, flags=re.M)
    names = [one for groups in labels for one in groups if one]
    names += [cell.metadata.mystnb.figure.name for name in NOTEBOOKS for cell in figures(name)]
    assert sorted(names) == sorted(set(names))


@each_chapter
def test_the_first_code_cell_and_no_other_holds_the_parameters(name):
    assert ["parameters" in tags(cell) for cell in code(name)] == [True] + [False] * (
        len(code(name)) - 1
    )


@each_chapter
def test_the_second_code_cell_refuses_parameters_that_make_no_sense(name):
    path = ROOT / f"book/{name}.ipynb"
    nonsense = {"episodes": 0, "seeds": "[3]", "layout": "nowhere"}
    for parameter in build.parameters(path):
        if parameter in nonsense:
            with pytest.raises(build.Failure, match=parameter):
                build.ask(path, {parameter: nonsense[parameter]})


@each_chapter
def test_a_chapter_names_its_learning_goals(name):
    assert re.search(r"\{admonition\} Learning goals\n", prose(name))


@each_chapter
def test_every_exercise_has_a_cell_that_checks_and_a_folded_solution(name):
    cells = NOTEBOOKS[name].cells
    text = "\n\n".join(f"\n{cell.source}" for cell in cells)
    exercises = re.findall(r"^:{3,}\{exercise\}.*\n:label: (\S+)$", text, flags=re.M)
    solutions = re.findall(r"^:{3,}\{solution\} (\S+)\n:class: dropdown$", text, flags=re.M)
    assert len(exercises) >= 2
    assert exercises == solutions
    for label in exercises:
        between = text.split(f":label: {label}\n")[1].split(f"{{solution}} {label}\n")[0]
        assert re.search(r"^assert ", between, flags=re.M), label


def commands(name: str) -> list[list[str]]:
    """The command lines of the Try box, each split as a shell would."""
    box = re.search(r"^(:{3,})\{admonition\} Try\n(.*?)^\1$", prose(name), flags=re.M | re.S)
    assert box, "there is no Try box"
    lines = re.sub(r"\\\n", " ", box[2]).splitlines()
    return [shlex.split(line) for line in lines if re.match(r"(papermill|make chapter) ", line)]


def chapter_and_parameters(words: list[str]) -> tuple[str, dict]:
    """What one command of a Try box asks for, read by papermill's or the driver's own parser."""
    if words[0] == "papermill":
        given = papermill.make_context("papermill", words[1:]).params
        pairs, raw, texts = (given[f"parameters{suffix}"] for suffix in ("", "_raw", "_yaml"))
        return given["notebook_path"], build.values(pairs, raw, texts)
    named = dict(word.split("=", 1) for word in words[2:])
    given = build.main.make_context("build", shlex.split(named.get("P", ""))).params
    return named["CHAPTER"], build.values(given["pairs"], given["raw"], given["texts"])


@each_chapter
def test_the_commands_of_the_try_box_are_accepted(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    lines = commands(name)
    assert any(words[0] == "papermill" for words in lines)
    for words in lines:
        chapter, given = chapter_and_parameters(words)
        build.refuse_unknown(build.known(chapter), given)
        build.ask(build.known(chapter), given)
