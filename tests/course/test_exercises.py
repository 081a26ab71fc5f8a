"""Exercises as groups of cells, in a notebook of this test's own and in every chapter."""

from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from nmpcrl.course.exercises import exercises

BOOK = Path(__file__).resolve().parents[2] / "book"
NOTEBOOKS = {path.stem: nbformat.read(path, 4) for path in sorted(BOOK.glob("*.ipynb"))}
EXERCISED = [name for name, notebook in NOTEBOOKS.items() if any(exercises(notebook))]
HEAD = '<a id="ex-{}"></a>\n**Exercise 1.{}.** *5 minutes, {} points.* How?'
ANSWER = "x = ...  # a number\n### BEGIN SOLUTION\nx = 2\n### END SOLUTION"


def markdown(source: str, tag: str):
    return new_markdown_cell(source, metadata={"tags": [tag]})


def code(source: str, tag: str):
    return new_code_cell(source, metadata={"tags": [tag]})


def notebook():
    return new_notebook(
        cells=[
            markdown(HEAD.format("one", 1, 3), "exercise"),
            markdown("Think.", "hint"),
            code(ANSWER, "answer"),
            code("check.one(x)", "check"),
            markdown("So.", "solution"),
            markdown(HEAD.format("two", 2, 1), "exercise"),
            markdown("As.", "solution"),
            new_markdown_cell("The end."),
            markdown("A loose one.", "hint"),
        ]
    )


def test_a_group_goes_from_its_text_to_the_next_cell_of_another_kind():
    one, two = exercises(notebook())
    assert (one.name, one.number, one.points) == ("one", "1.1", 3)
    assert (two.name, two.number, two.points) == ("two", "1.2", 1)
    assert {part for part, cells in one.parts.items() if cells} == {
        "hint", "answer", "check", "solution",
    }  # fmt: skip
    assert [cell.source for cell in two.parts["solution"]] == ["As."]
    assert one.solution == "x = 2"


@pytest.mark.parametrize("name", EXERCISED)
def test_a_chapter_has_four_to_six_exercises_in_order_each_complete(name):
    every = list(exercises(NOTEBOOKS[name]))
    assert 4 <= len(every) <= 6
    assert [int(one.number.split(".")[-1]) for one in every] == [*range(1, len(every) + 1)]
    assert len({one.number.rpartition(".")[0] for one in every}) == 1
    for one in every:
        counts = {part: len(cells) for part, cells in one.parts.items()}
        assert 1 <= counts["hint"] <= 3, one.number
        assert counts["answer"] == counts["check"] == counts["solution"] == 1, one.number
        assert one.solution, one.number
        titles = ["Solution", *(f"Hint {k}" for k in range(1, counts["hint"] + 1))]
        for cell, title in zip([*one.parts["solution"], *one.parts["hint"]], titles, strict=True):
            assert cell.source.startswith(f"<details><summary>{title}</summary>\n\n")
            assert cell.source.endswith("\n\n</details>")
