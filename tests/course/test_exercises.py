"""Exercises as groups of cells: what belongs together, and what a solution puts where."""

import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from nmpcrl.course.exercises import About, NoExercise, exercises, reopened, solved

ABOUT = {"kind": "by hand", "level": 1, "minutes": 5, "points": 1, "goal": "compute"}


def markdown(source: str, tag: str, **about):
    ours = {"nmpcrl": {"exercise": about}} if about else {}
    return new_markdown_cell(source, metadata={"tags": [tag]} | ours)


def code(source: str, tag: str):
    return new_code_cell(source, metadata={"tags": [tag]})


def notebook():
    return new_notebook(
        cells=[
            markdown('<a id="ex-one"></a>\n**Exercise 1.1.** How?', "exercise", **ABOUT),
            markdown("Think.", "hint"),
            code("x = ...", "answer"),
            code("check.one(x)", "check"),
            markdown("So:\n\n```python\nx = 2\n```\n\nor\n\n```text\nx = 3\n```", "solution"),
            markdown('<a id="ex-two"></a>\n**Exercise 1.2.** Why?', "exercise", **ABOUT),
            markdown("As.", "solution"),
            new_markdown_cell("The end."),
            markdown("A loose one.", "hint"),
        ]
    )


def test_a_group_goes_from_its_text_to_the_next_cell_of_another_kind():
    one, two = exercises(notebook())
    assert (one.name, one.number, two.name, two.number) == ("one", "1.1", "two", "1.2")
    assert {part: len(cells) for part, cells in one.parts.items() if cells} == {
        "hint": 1,
        "answer": 1,
        "check": 1,
        "solution": 1,
    }
    assert [cell.source for cell in two.parts["solution"]] == ["As."]
    assert one.answers == ["x = 2"]


def test_the_line_says_kind_level_minutes_and_points():
    assert About(**ABOUT).line == "By hand · level 1 of 3 · 5 minutes · 1 point"
    assert About("project", 2, 60, 4, "measure").line.endswith("60 minutes · 4 points")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"kind": "riddle"}, "'riddle' is none of by hand"),
        ({"level": 4}, "level 4"),
        ({"points": 0}, "1 or more"),
        ({"goal": ""}, "goal"),
        ({"minute": 3}, "Exercise 1.1 has 'minute'"),
    ],
)
def test_metadata_that_make_no_sense_are_refused(wrong, said):
    source = notebook()
    source.cells[0].metadata["nmpcrl"]["exercise"].update(wrong)
    with pytest.raises(NoExercise, match=said):
        list(exercises(source))


def test_an_exercise_without_a_number_is_refused():
    source = notebook()
    source.cells[0].source = "How?"
    with pytest.raises(NoExercise, match="does not begin with a label"):
        list(exercises(source))


def test_a_solution_stands_in_for_the_answer_and_can_be_taken_back():
    source = notebook()
    answered = solved(source)
    assert answered.cells[2].source == "x = 2"
    answered.cells[3].outputs = [new_output("display_data", {"text/plain": "Right."})]
    assert source.cells[2].source == "x = ..."  # a copy was solved
    assert reopened(answered) == source


def test_a_solution_has_code_for_each_answer():
    source = notebook()
    source.cells[4].source = "So it is 2."
    with pytest.raises(ValueError, match="zip"):
        solved(source)
