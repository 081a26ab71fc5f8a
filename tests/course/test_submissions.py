"""What a student hands in, put into the chapter."""

from driver.course import editions
from nbformat.v4 import new_code_cell
from small_course import cell_of, small_chapter, solved_by_student

from nmpcrl.course.submissions import chapters


def test_added_cells_stay_behind_the_cell_that_they_followed(submission):
    notebook = editions.student(small_chapter(), set())
    at = notebook.cells.index(cell_of(notebook, "two-text"))
    notebook.cells.insert(at + 1, new_code_cell("power = 2", id="own"))
    every = submission(notebook)[1].steps
    (own,) = (k for k, step in enumerate(every) if step.code == "power = 2")
    assert (every[own].group, every[own + 1].name) == ("two", "two-answer")


def test_an_answer_is_found_by_its_exercise_where_an_editor_has_renamed_the_cells(submission):
    notebook = solved_by_student(three="root_of_three = 2.0")
    for k, cell in enumerate(notebook.cells):
        cell.id = f"other-{k}"
    by_name = {step.name: step.code for step in submission(notebook)[1].steps}
    assert by_name["three-answer"] == "root_of_three = 2.0"


def test_the_edition_for_graders_runs_without_its_solutions(edition):
    (chapter,) = chapters(edition)
    code = "\n".join(cell.source for cell in chapter.notebook.cells)
    assert "SOLUTION" not in code
    assert "math.sqrt" not in code
