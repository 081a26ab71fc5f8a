"""A chapter that takes no time to run, as a student gets it: exercises that all ask for a root."""

import csv
from pathlib import Path

import nbformat
from click.testing import CliRunner
from driver.course import editions
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from nmpcrl.commands import main

SMALL = "01_small"
ASKED = ("one", "two", "three", "four", "five", "six", "seven")  # of each the square root of four
CHECKS = f"""from types import SimpleNamespace
from nmpcrl.course import exercise, number
check = SimpleNamespace(**{{name: exercise(lambda a: number(a, 2)) for name in {ASKED}}})"""
SOLUTION = "<details><summary>Solution</summary>\n\n```python\n{}\n```\n\n</details>"


def exercise(number, name, answer="root_of_{} = ...", asked="root_of_{}"):
    """The cells of an exercise that asks for a root, or for something else."""
    answer, asked = answer.format(name), asked.format(name)
    about = {"kind": "by hand", "level": 1, "minutes": 1, "points": number, "goal": "a root"}
    head = f'<a id="ex-{name}"></a>\n**Exercise 1.{number}.** What is the root of `four`?'
    code = f"import math\nroot_of_{name} = math.sqrt(four)"
    return [
        new_markdown_cell(head, id=f"{name}-text", metadata={"nmpcrl": {"exercise": about}}),
        tagged("answer", new_code_cell(answer, id=f"{name}-answer")),
        tagged("check", new_code_cell(f"check.{name}({asked})", id=f"{name}-check")),
        tagged("solution", new_markdown_cell(SOLUTION.format(code), id=f"{name}-solution")),
    ]


def tagged(tag, cell):
    cell.metadata["tags"] = [tag]
    return cell


def project():
    about = {"kind": "project", "level": 3, "minutes": 9, "points": 6, "goal": "a report"}
    head = '<a id="ex-open"></a>\n**Exercise 1.8.** Write a report.'
    return [
        new_markdown_cell(head, id="open-text", metadata={"nmpcrl": {"exercise": about}}),
        tagged("rubric", new_markdown_cell("A rubric", id="open-rubric")),
    ]


def small_chapter():
    """The source: seven exercises, worth one to seven points, and a project."""
    cells = [
        new_markdown_cell("# Small", id="title"),
        new_code_cell("four = 4.0", id="chapter"),
        new_code_cell(CHECKS, id="exercises-checks"),
    ]
    for number, name in enumerate(ASKED, start=1):
        cells += exercise(number, name)
        cells.append(new_code_cell("sorted([four])", id=f"between-{number}"))
    return new_notebook(cells=[*cells, *project()])


def solved_by_student(**answers):
    """The notebook of a student who solves all exercises, but for some other answers."""
    notebook = editions.student(small_chapter(), set())
    for name in ASKED:
        answer = answers.get(name, f"root_of_{name} = 2")
        cell_of(notebook, f"{name}-answer").source = answer
    return notebook


def cell_of(notebook, name):
    return next(cell for cell in notebook.cells if cell.id == name)


def edition_in(folder: Path) -> Path:
    """The edition for graders of the small chapter."""
    place, data = (folder / "edition" / name for name in (f"source/{SMALL}", "data"))
    place.mkdir(parents=True)
    (data / "published").mkdir(parents=True)
    (data / "of_the_chapter.txt").write_text("4")
    nbformat.write(editions.grader(small_chapter(), set()), place / f"{SMALL}.ipynb")
    return folder / "edition"


def graded_in(folder: Path, edition: Path, *words: str, name=SMALL, **handed):
    """By student, the rows of the CSV file by exercise; notebooks are handed in to a folder."""
    for student, notebook in handed.items():
        place = folder / "in" / student / f"{name}.ipynb"
        place.parent.mkdir(parents=True)
        text = notebook if isinstance(notebook, str) else nbformat.writes(notebook)
        place.write_text(text)
    out = folder / "grades.csv"
    given = ["grade", str(folder / "in"), "--out", str(out), "--edition", str(edition)]
    called = CliRunner().invoke(main, [*given, *words])
    assert called.exit_code == 0, called.output
    assert "no sandbox" in called.output
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {s: {r["exercise"]: r for r in rows if r["student"] == s} for s in handed}
