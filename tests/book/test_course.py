"""The material of a course: editions of every chapter, slides, and what nbgrader makes of them."""

import os
import subprocess
import sys
import venv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import nbformat
import pytest
from driver.course import course, editions, slides
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output
from small_course import ASKED, cell_of, small_chapter

from nmpcrl.course.exercises import exercises, tags_of
from nmpcrl.course.grading import Limits, losses

CHAPTERS = course.chapters()
each_chapter = pytest.mark.parametrize("name", CHAPTERS)
LIMITS = Limits(seconds=120)  # the machine may be busy
TO_PNG = {"image/png": "iVBORw0KGgo="}


def lost(release, handed):
    """`losses` in a thread of its own: the browser of other tests has the loop of this one."""
    with ThreadPoolExecutor(1) as apart:
        return apart.submit(losses, release, handed, LIMITS).result()


@each_chapter
def test_a_students_notebook_has_no_solution_and_links_of_an_edition_stay_beside_it(name):
    notebook = editions.student(CHAPTERS[name], CHAPTERS)
    text = nbformat.writes(notebook)
    assert "SOLUTION" not in text
    assert "<summary>Solution" not in text
    assert not any("notes" in tags_of(cell) for cell in notebook.cells)
    for one in exercises(CHAPTERS[name]):
        assert one.solution not in text
    for one in exercises(notebook):
        assert all("raises-exception" in tags_of(cell) for cell in one.parts["check"])
    for cell in editions.teacher(CHAPTERS[name], CHAPTERS).cells:
        assert {link["page"] for link in editions.LINK.finditer(cell.source)} <= {*CHAPTERS}


@pytest.fixture
def executed(tmp_path) -> Path:
    """A chapter of two slides, one with a formula, notes and a figure."""
    cells = [
        new_markdown_cell("# One\n\n$x^2$", metadata={"tags": ["slide"]}),
        new_markdown_cell("Not on a slide."),
        new_markdown_cell("Say this.", metadata={"tags": ["notes", "remove-cell"]}),
        new_markdown_cell("## Two", metadata={"tags": ["slide", "remove-cell"]}),
        new_code_cell("secret_code()", metadata={"tags": ["slide"]}),
    ]
    cells[-1].metadata["mystnb"] = {"image": {"alt": "A curve."}}
    cells[-1].outputs = [new_output("display_data", TO_PNG, metadata={})]
    nbformat.write(new_notebook(cells=cells), tmp_path / "executed.ipynb")
    return tmp_path / "executed.ipynb"


def test_a_deck_shows_its_slides_without_a_network(executed, tmp_path, browser):
    pytest.importorskip("nbconvert")
    slides.write([executed], tmp_path / "slides")
    page, asked = browser.new_page(), []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((tmp_path / "slides/executed.html").as_uri())
    page.wait_for_selector("html[data-ready]")
    assert all(url.startswith(("file:", "data:", "blob:")) for url in asked)
    assert page.locator(".slides > section").count() == 2
    assert page.locator("section.present h1").inner_text() == "One"
    assert page.locator("section.present mjx-container").count() == 1
    assert page.locator("aside.notes").first.text_content().strip() == "Say this."
    page.keyboard.press("ArrowRight")
    assert page.locator("section.present h2").inner_text() == "Two"
    assert page.locator("section.present img").first.get_attribute("alt") == "A curve."
    assert "secret_code" not in page.content()
    assert "Not on a slide" not in page.content()
    page.close()


@pytest.mark.slow
@each_chapter
def test_a_solved_chapter_has_all_points_and_an_empty_one_has_none(name, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    release = editions.student(CHAPTERS[name], CHAPTERS)
    assert set(lost(release, editions.teacher(CHAPTERS[name], CHAPTERS)).values()) == {""}
    assert all(lost(release, release).values())


@pytest.fixture(scope="module")
def nbgrader(tmp_path_factory) -> Path:
    """The commands of an environment in which nbgrader is installed."""
    place = tmp_path_factory.mktemp("nbgrader") / "venv"
    venv.create(place, with_pip=True)
    pip = [place / "bin/pip", "install", "-q", "nbgrader==0.9.6"]
    done = subprocess.run(pip, capture_output=True, text=True)
    if "No matching distribution" in done.stderr and "NMPCRL_REQUIRE_REGISTRY" not in os.environ:
        pytest.skip(f"the registry cannot be reached: {done.stderr.splitlines()[-1]}")
    assert done.returncode == 0, done.stderr
    kernel = [sys.executable, "-m", "ipykernel", "install", "--prefix", place]
    subprocess.run(kernel, check=True, capture_output=True)
    return place / "bin"


def of_nbgrader(commands: Path, place: Path, *words: str) -> None:
    done = subprocess.run(
        [commands / "nbgrader", *words], cwd=place, capture_output=True, text=True,
        env=os.environ | {"PATH": f"{commands}:{os.environ['PATH']}"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.network
def test_nbgrader_gives_the_same_points(nbgrader, tmp_path):
    source = tmp_path / "source/small/small.ipynb"
    source.parent.mkdir(parents=True)
    nbformat.write(editions.for_nbgrader(small_chapter(), set()), source)
    (tmp_path / "nbgrader_config.py").write_text(editions.NBGRADER_CONFIG)
    of_nbgrader(nbgrader, tmp_path, "generate_assignment", "small")
    handed = editions.student(small_chapter(), set())
    for name, answer in zip(ASKED, ("2", "4.0", "...", "2.0"), strict=True):
        cell_of(handed, f"{name}-answer").source = f"root_of_{name} = {answer}"
    place = tmp_path / "submitted/anna/small/small.ipynb"
    place.parent.mkdir(parents=True)
    nbformat.write(handed, place)
    of_nbgrader(nbgrader, tmp_path, "autograde", "small")
    of_nbgrader(nbgrader, tmp_path, "export", "--to", "grades.csv")
    why = lost(editions.student(small_chapter(), set()), handed)
    points = sum(one.points for one in exercises(small_chapter()) if not why[one.name])
    header, row = (line.split(",") for line in (tmp_path / "grades.csv").read_text().splitlines())
    assert float(row[header.index("score")]) == points == 5
