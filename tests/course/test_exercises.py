"""Exercises as groups of cells, in a notebook of this test's own and in every chapter."""

from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_markdown_cell, new_notebook
from small_course import exercise

from nmpcrl.course.exercises import exercises

BOOK = Path(__file__).resolve().parents[2] / "book"
NOTEBOOKS = {path.stem: nbformat.read(path, 4) for path in sorted(BOOK.glob("*.ipynb"))}
EXERCISED = [name for name, notebook in NOTEBOOKS.items() if any(exercises(notebook))]


def test_a_group_goes_from_its_text_to_the_next_cell_of_another_kind():
    cells = [
        *exercise("one", points=3),
        *exercise("two", "1.2")[::3],
        new_markdown_cell("The end."),
    ]
    hints = [new_markdown_cell("Think.", metadata={"tags": ["hint"]}) for _ in range(2)]
    one, two = exercises(new_notebook(cells=[cells[0], hints[0], *cells[1:], hints[1]]))
    assert (one.name, one.number, one.points) == ("one", "1.1", 3)
    assert (two.name, two.number, two.points) == ("two", "1.2", 1)
    assert {part: len(some) for part, some in one.parts.items() if some} == dict.fromkeys(
        ("hint", "answer", "check", "solution"), 1
    )
    assert {part for part, some in two.parts.items() if some} == {"solution"}
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
