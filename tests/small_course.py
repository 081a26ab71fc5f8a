"""A chapter that takes no time to run: exercises that all ask for a root."""

from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

ASKED = ("one", "two", "three", "four")  # of each the square root of four
CHECKS = """from types import SimpleNamespace
from nmpcrl.course import number
root = lambda a: number(a, 2, mistakes={4.0: "Take the root."})
check = SimpleNamespace(one=root, two=root, three=root, four=root)"""
HEAD = (
    '<a id="ex-{1}"></a>\n**Exercise 1.{0}.** *1 minute, {0} points.* '
    "What is the root of the number `four`?"
)
ANSWER = "root_of_{0} = ...\n### BEGIN SOLUTION\nroot_of_{0} = 2\n### END SOLUTION"
SOLUTION = "<details><summary>Solution</summary>\n\nIt is 2.\n\n</details>"


def small_chapter():
    """The source: four exercises, worth one to four points."""
    cells = [
        new_markdown_cell("# Small", id="title"),
        new_code_cell("four = 4.0", id="chapter"),
        new_code_cell(CHECKS, id="exercises-checks"),
    ]
    for number, name in enumerate(ASKED, start=1):
        cells += [
            tagged("exercise", new_markdown_cell(HEAD.format(number, name), id=f"{name}-text")),
            tagged("answer", new_code_cell(ANSWER.format(name), id=f"{name}-answer")),
            tagged("check", new_code_cell(f"check.{name}(root_of_{name})", id=f"{name}-check")),
            tagged("solution", new_markdown_cell(SOLUTION, id=f"{name}-solution")),
        ]
    return new_notebook(cells=cells)


def tagged(tag, cell):
    cell.metadata["tags"] = [tag]
    return cell


def cell_of(notebook, name):
    return next(cell for cell in notebook.cells if cell.id == name)
