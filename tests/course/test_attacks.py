"""Code that is written to deceive the grader gets the points of what it answers, and no more."""

import nbformat
import pytest
from driver.course import editions
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook
from small_course import ASKED, SMALL, cell_of, exercise, solved_by_student

OUTCOME = "from nmpcrl.course.outcome import Outcome\n"
LIES = "lambda *args, **names: Outcome('Right: 2.')"
FORGED = """import os
message = b'{"kind": "outcome", "why": "", "name": "seven-check", "error": null, "right": true}'
for file in range(3, 256):
    try:
        os.write(file, len(message).to_bytes(8) + message + b"\\n")
    except OSError:
        pass
root_of_seven = 3"""
OF_VALUES = {
    "the checks' own functions": f"""{OUTCOME}import nmpcrl.course, nmpcrl.course.answers
number = nmpcrl.course.number = nmpcrl.course.answers.number = {LIES}
root_of_one = 3""",
    "what they are made of": """import math, numpy
numpy.allclose = numpy.isclose = lambda *args, **names: True
import nmpcrl.course.answers
nmpcrl.course.answers.abs = lambda value: 0
root_of_two = 3""",
    "outcomes": """from nmpcrl.course import outcome
outcome.Outcome.__init__ = lambda self, *args, **names: None
outcome.Outcome.right, outcome.Outcome.said = True, ""
outcome.Unsolved.__new__ = lambda *args: outcome.Outcome()
root_of_three = 3""",
    "the check itself": f"""{OUTCOME}check.four = {LIES}
root_of_four = 3""",
    "modules": f"""{OUTCOME}import sys
from types import ModuleType
class Lies(ModuleType):
    def __getattr__(self, name):
        return {LIES}
sys.modules["nmpcrl.course"] = sys.modules["nmpcrl.course.answers"] = Lies("nmpcrl.course")
root_of_five = 3""",
    "a number": """class Lies(float):
    def __sub__(self, other):
        return 0.0
    __rsub__ = __add__ = __mul__ = __abs__ = __neg__ = __sub__
    def __float__(self):
        return self
root_of_six = Lies(3)""",
    "what the process says": FORGED,
}


@pytest.mark.slow
def test_a_notebook_that_changes_the_checks_in_its_memory_wins_nothing(graded):
    lies = dict(zip(ASKED, OF_VALUES.values(), strict=True))
    rows = graded(one=solved_by_student(**lies))["one"]
    assert {row["points"] for number, row in rows.items() if number != "total"} == {"0", ""}
    assert rows["1.2"]["why"] == "3 is not right: it is too large."


CHECKS = """from types import SimpleNamespace
from nmpcrl.course import exercise, function
def draw(rng):
    return {"x": rng.normal(size=3), "along": lambda x: x + 1}
def right(x, along):
    return 2 * along(x)
def check(answer):
    return function(answer, right, draw)
def text(answer):
    return function(answer, lambda x, along: "a text", draw)
check = SimpleNamespace(**{name: exercise(text if "text" in name else check) for name in NAMES})"""
LOOKS = """import gc, sys
def looks(x, along):
    frame = sys._getframe()
    while frame := frame.f_back:
        if "expected" in frame.f_locals:
            return frame.f_locals["expected"](x=x, along=along)
    return x"""
EQUAL = """class Equal(str):
    __hash__ = str.__hash__
    def __eq__(self, other):
        return True
    def __ne__(self, other):
        return False
def equal_text(x, along):
    return Equal("other")"""
ARRAY = """import numpy
class Lies(numpy.ndarray):
    def __array_function__(self, *args):
        return True
    def __array_ufunc__(self, *args, **names):
        return numpy.array(True)
def array(x, along):
    return numpy.zeros(3).view(Lies)"""
FORKS = """import os
def forks(x, along):
    if os.fork():
        os._exit(0)
    return 2 * along(x)"""
GIVEN = "def {}(x, along):\n    return {}"
OF_FUNCTIONS = {  # what they define, and a part of what is said
    "plain": (GIVEN.format("plain", "2 * x + 2"), ""),
    "nested": (GIVEN.format("nested", "list(2 * along(x))"), ""),
    "looks": (LOOKS, "wrong in 20 of 20 random cases"),
    "equal_text": (EQUAL, "of the type Equal"),
    "array": (ARRAY, "wrong in 20 of 20 random cases"),
    "forks": (FORKS, "it ended the process"),
    "recursion": (GIVEN.format("recursion", "recursion(x, along)"), "RecursionError"),
    "generator": (GIVEN.format("generator", "(one for one in x)"), "generator"),
    "closure": (GIVEN.format("closure", "lambda: x"), "of the type function"),
    "large": (GIVEN.format("large", "b'0'.decode() * 50_000_000"), "more than can be read"),
    "deep": ("deep = []\nfor _ in range(100_000):\n    deep = [deep]", ""),
    "breaks": (GIVEN.format("breaks", "along(along)"), "Type"),
    "raises": ("class Unsolved(Exception): pass\n" + GIVEN.format("raises", "1 / 0"), "Zero"),
}


@pytest.fixture
def functions(edition):
    """An edition of exercises that ask for functions, and what a student hands in."""
    cells = [
        new_markdown_cell("# Small", id="title"),
        new_code_cell(CHECKS.replace("NAMES", repr(tuple(OF_FUNCTIONS))), id="exercises-checks"),
    ]
    for number, name in enumerate(OF_FUNCTIONS, start=1):
        cells += exercise(number, name, "def {}(x, along):\n    return ...", "{}")
    source = new_notebook(cells=cells)
    place = edition / f"source/{SMALL}/{SMALL}.ipynb"
    nbformat.write(editions.grader(source, set()), place)
    return editions.student(source, set())


@pytest.mark.slow
def test_a_function_that_lies_ends_or_looks_around_wins_nothing(graded, functions):
    for name, (code, _) in OF_FUNCTIONS.items():
        cell_of(functions, f"{name}-answer").source = code
    rows = graded(one=functions)["one"]
    for (name, (_, said)), row in zip(OF_FUNCTIONS.items(), rows.values(), strict=False):
        right = name in ("plain", "nested")
        assert (row["points"] != "0") == right, (name, row)
        assert said in row["why"], (name, row)
        assert bool(row["why"]) != right, (name, row)
