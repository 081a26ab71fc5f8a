"""Marks that nbgrader and otter read."""

import nbformat
import pytest
from driver.course import editions
from small_course import ASKED, cell_of, small_chapter


def marked(**words):
    return editions.grader(small_chapter(), set(), **words)


def test_nbgrader_finds_solutions_points_and_what_is_locked():
    notebook = marked()
    nbformat.validate(notebook)
    kinds = ("grade", "locked", "solution", "task")
    expected = {
        "one-answer": ((False, False, True, False), None),
        "three-check": ((True, True, False, False), 3),
        "open-rubric": ((False, True, False, True), 6),
        "exercises-checks": ((False, True, False, False), None),
    }
    for name, (kind, points) in expected.items():
        marks = cell_of(notebook, name).metadata["nbgrader"]
        assert tuple(marks[one] for one in kinds) == kind, name
        assert marks.get("points") == points, name
        assert (marks["schema_version"], marks["grade_id"]) == (3, name)
    graded = [cell for cell in notebook.cells if cell.metadata.get("nbgrader", {}).get("grade")]
    assert len(graded) == len(ASKED)


@pytest.mark.parametrize("otter", [False, True])
def test_a_solution_stands_in_a_region_that_is_taken_out_and_nowhere_else(otter):
    notebook = marked(otter=otter)
    assert not any("solution" in cell.metadata.get("tags", []) for cell in notebook.cells)
    for cell in notebook.cells:
        outside = cell.source.partition("# BEGIN SOLUTION")[0]
        assert "math.sqrt" not in outside
    answer = cell_of(notebook, "one-answer").source
    assert answer.startswith("root_of_one = ...\n")
    assert answer.rstrip().endswith("# END SOLUTION")


def test_otter_gets_a_question_around_each_exercise_with_a_check():
    notebook = marked(otter=True)
    nbformat.validate(notebook)
    raw = [cell.source for cell in notebook.cells if cell.cell_type == "raw"]
    words = [source.splitlines()[0].removeprefix("# ") for source in raw]
    question = ["BEGIN QUESTION", "BEGIN SOLUTION", "END SOLUTION"]
    question += ["BEGIN TESTS", "END TESTS", "END QUESTION"]
    assert words == ["ASSIGNMENT CONFIG", *question * len(ASKED)]
    assert "name: two\npoints: 2" in raw[7]
