"""Other numbers from a secret: published answers do not fit, and those of the edition do."""

import importlib
import re
from math import comb
from pathlib import Path

import nbformat
import numpy as np
import pytest
from driver.course import course

from nmpcrl.course import variants
from nmpcrl.course.exercises import exercises
from nmpcrl.course.variants import CHECKS, values, varied, without

ROOT = Path(__file__).resolve().parents[2]
SOURCES = course.chapters()
VARIED = {  # by chapter
    "01_mdp_and_nmpc.ipynb": ["1.1"],
    "02_expected_sarsa.ipynb": ["2.1", "2.3", "2.6"],
    "03_rdes.ipynb": ["3.1", "3.2", "3.3"],
    "04_ges.ipynb": ["4.1", "4.2", "4.3"],
    "05_results.ipynb": ["5.3"],
    "06_what_the_paper_leaves_open.ipynb": ["6.1", "6.4"],
    "07_beyond.ipynb": ["7.1", "7.2", "7.3"],
    "solver.ipynb": ["8.1", "8.4"],
    "performance.ipynb": ["9.2", "9.3"],
    "other_problems.ipynb": ["10.1"],
    "what_to_try_first.ipynb": ["11.1"],
    "why_learning_stops.ipynb": ["12.1"],
    "changing_world.ipynb": ["13.1"],
}

each_chapter = pytest.mark.parametrize("name", SOURCES)


def counted(notebook):
    """The exercises with a check that count."""
    return [one for one in exercises(notebook) if one.parts["check"] and one.about.counts]


def outcome(notebook, one, code: str):
    """What the check of an exercise says to an answer."""
    imports = next(cell.source for cell in notebook.cells if cell.id == CHECKS)
    names = {"np": np, "comb": comb}
    exec(imports, names)
    exec(code, names)
    return eval(one.parts["check"][0].source, names)


@each_chapter
def test_exercises_have_other_numbers_or_do_not_count(name):
    notebook = varied(SOURCES[name], b"a secret")
    nbformat.validate(notebook)
    public = {one.number: one for one in exercises(SOURCES[name])}
    assert [one.number for one in counted(notebook)] == VARIED[name]
    for one in exercises(notebook):
        same = one.text.source == public[one.number].text.source
        assert same == (one.number not in VARIED[name])
        if not same:
            assert not one.parts["hint"]
            assert one.about.worth == public[one.number].about.points
        elif one.parts["check"]:
            assert one.about.worth == 0
            assert one.about.line.endswith("practice")


@each_chapter
def test_with_any_number_the_published_answer_is_refused_and_the_editions_own_is_right(
    name, monkeypatch
):
    public = {one.number: one for one in exercises(SOURCES[name])}
    checks = importlib.import_module(f"nmpcrl.course.checks.{module(name)}")
    for number in VARIED[name]:
        (within,) = getattr(checks, function(public[number])).varied.values()
        for value in values(within):
            monkeypatch.setattr(variants, "_drawn", lambda *_, value=value: value)
            notebook = varied(SOURCES[name], b"")
            (one,) = (one for one in exercises(notebook) if one.number == number)
            assert outcome(notebook, one, one.answers[0]).right
            assert not outcome(notebook, one, public[number].answers[0]).right


def module(name: str) -> str:
    return name.removesuffix(".ipynb").lstrip("0123456789_")


def function(one) -> str:
    return one.parts["check"][0].source.removeprefix("check.").partition("(")[0]


def test_the_same_secret_gives_the_same_bytes_and_another_one_other_numbers():
    first, again, other = (
        {name: nbformat.writes(varied(source, secret)) for name, source in SOURCES.items()}
        for secret in (b"one", b"one", b"\xff\x00other")
    )
    assert first == again
    assert all(first[name] != other[name] for name in SOURCES)


@each_chapter
def test_students_get_no_check_of_an_exercise_that_counts(name):
    checks = importlib.import_module(f"nmpcrl.course.checks.{module(name)}")
    left = without(Path(checks.__file__).read_text())
    names = {"__name__": "left"}
    exec(compile(left, "left", "exec"), names)
    for one in exercises(SOURCES[name]):
        if one.parts["check"]:
            assert (function(one) in names) == (one.number not in VARIED[name])


def test_the_page_for_teachers_names_the_exercises_that_count():
    page = (ROOT / "book/teach.md").read_text()
    (sentence,) = re.findall(r"\*\*Twenty-four exercises count\*\*[^:]*: (.*?\d)\. ", page)
    every = [number for numbers in VARIED.values() for number in numbers]
    assert sorted(re.split(", | and ", sentence)) == sorted(every)
