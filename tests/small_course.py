"""Exercises, and a chapter that takes no time to run: four of them, which ask for a root."""

from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

ASKED = ("one", "two", "three", "four")  # of each the square root of four
CHECKS = """from types import SimpleNamespace
from nmpcrl.course import number
root = lambda a: number(a, 2, mistakes={4.0: "Take the root."})
check = SimpleNamespace(one=root, two=root, three=root, four=root)"""


def exercise(name, number="1.1", *, points=1, given="x = ...", solution="x = 2", check=None):
    """The cells of an exercise."""
    head = f'<a id="ex-{name}"></a>\n**Exercise {number}.** *5 minutes, {points} point'
    sources = {
        "exercise": f"{head}{'s' * (points > 1)}.* How?",
        "answer": f"{given}\n### BEGIN SOLUTION\n{solution}\n### END SOLUTION",
        "check": check or f"check.{name}({given.split()[0]})",
        "solution": "<details><summary>Solution</summary>\n\nThus.\n\n</details>",
    }
    code = {"answer": new_code_cell, "check": new_code_cell}
    return [
        code.get(tag, new_markdown_cell)(source, id=f"{name}-{tag}", metadata={"tags": [tag]})
        for tag, source in sources.items()
    ]


def small_chapter():
    """The source: four exercises, worth one to four points."""
    cells = [
        new_markdown_cell("# Small", id="title"),
        new_code_cell("four = 4.0", id="chapter"),
        new_code_cell(CHECKS, id="exercises-checks"),
    ]
    for k, name in enumerate(ASKED, start=1):
        given, solution = (f"root_of_{name} = {one}" for one in ("...", "2"))
        cells += exercise(name, f"1.{k}", points=k, given=given, solution=solution)
    return new_notebook(cells=cells)


def cell_of(notebook, name):
    return next(cell for cell in notebook.cells if cell.id == name)
