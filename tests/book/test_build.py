"""The build, book/driver/build: what it refuses, and what it leaves when a step fails."""

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import nbformat
import pytest
import yaml
from bs4 import BeautifulSoup
from builders import raising
from click.testing import CliRunner
from driver import project
from driver.build import book, chapters, execute, train
from filelock import FileLock
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook
from small_course import exercise

from nmpcrl.claims.verdict import NOT, REPRODUCED, Verdict

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def driver(monkeypatch):
    """The command; whatever it is asked, it may not come as far as building."""

    for step in ("mirror", "train", "execute_all", "dress", "render"):
        monkeypatch.setattr(book, step, raising(AssertionError("the driver went on to build")))
    return lambda *arguments: CliRunner().invoke(book.main, arguments)


def refused(result) -> str:
    """The one sentence of a refusal."""
    assert result.exit_code == 1
    assert isinstance(result.exception, SystemExit)
    (sentence,) = result.output.strip().splitlines()
    return sentence


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("--chapter 03_rdes -p episode 20", "'episode' (did you mean 'episodes'?)"),
        ("--chapter 03_rde", "'03_rde'"),
        ("--chapter 03_rde", f", {[*project.notebooks()][-2]} and {[*project.notebooks()][-1]}."),
        ("--chapter 03_rdes -p episodes many", "episodes = 'many'"),
        ("--chapter 03_rdes -r episodes 20", "episodes = '20'"),
        ("--chapter 03_rdes -p episodes 90000", "episodes = 90000"),
        ("--chapter 03_rdes -p seeds [3]", "{seeds: [3]}"),
        ("--chapter 03_rdes -y [3]", "'[3]'"),
        ("-p episodes 20", "--chapter"),
    ],
)
def test_what_cannot_be_built_is_refused_in_one_sentence(driver, arguments, said):
    assert said in refused(driver(*arguments.split()))


@pytest.mark.parametrize("kind", ["missing", "file", "damaged"])
def test_without_what_is_published_nothing_is_built(driver, tmp_path, monkeypatch, kind):
    place = tmp_path / "published"
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(place))
    if kind == "file":
        place.write_text("")
    if kind == "damaged":
        place.mkdir()
        (place / "manifest.json").write_text("[" * 100_000)
    sentence = refused(driver("--chapter", "02_expected_sarsa"))
    assert str(place) in sentence
    assert "`git checkout -- book/published` restores" in sentence


def test_values_are_read_as_papermill_reads_them():
    given = chapters.values([("a", "1"), ("b", "[3]"), ("c", "1e-7")], [("d", "1")], ["{e: [3]}"])
    assert given == {"a": 1, "b": "[3]", "c": 1e-7, "d": "1", "e": [3]}


INTRO = """# A small book

See [Chapter 1](one.ipynb).
"""


@pytest.fixture
def small(tmp_path, robot_module) -> Path:
    """A copy of the driver with a book of one page and one chapter."""
    return small_book(tmp_path)


def small_book(place: Path) -> Path:
    for name in ("_static", "driver"):
        shutil.copytree(ROOT / "book" / name, place / "book" / name)
    for name in ("_config.yml", "Makefile", "book/build.py", "book/run.py"):
        shutil.copy2(ROOT / name, place / name)
    (place / "nmpcrl").symlink_to(ROOT / "nmpcrl")
    (place / "book/intro.md").write_text(INTRO)
    save(place, new_code_cell("print(episodes)"))
    listed(place, "one")
    return place


def listed(place: Path, *chapters: str) -> None:
    """Let the small book have these chapters."""
    files = [{"file": f"book/{name}"} for name in chapters]
    parts = [{"caption": "Part", "numbered": True, "chapters": files}]
    toc = {"format": "jb-book", "root": "book/intro", "parts": parts}
    (place / "_toc.yml").write_text(yaml.safe_dump(toc))


def save(place: Path, *last, name: str = "one") -> None:
    """Write a chapter of the small book, which ends in these cells."""
    cells = [
        new_markdown_cell(f"# {name.title()}"),
        new_code_cell("episodes = 300", metadata={"tags": ["parameters"]}),
        new_code_cell("experiments = ()"),
        *last,
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = new_notebook(cells=cells, metadata={"kernelspec": kernel})
    nbformat.write(notebook, place / f"book/{name}.ipynb")


CHOSEN = ("OMP_NUM_THREADS", "NO_COLOR")  # by a build itself


def run(place: Path, *arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, str(place / "book/build.py"), *arguments]
    inherited = os.environ.keys() - {"PYTHONPATH", *CHOSEN}
    environment = {name: os.environ[name] for name in inherited}
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


def far(solution: str) -> list:
    """Exercise 1.1 of the book, with a solution."""
    check = "from nmpcrl.course.checks import mdp_and_nmpc as check\n\ncheck.distance(d)"
    return exercise("far", given="d = ...", solution=solution, check=check)


EXECUTION = "print(open('executions', 'a').write('{}'))"  # leaves this letter
WHERE = "import ipykernel\nprint(ipykernel.get_connection_info())"
SETTINGS = f"import os\nprint(*[os.environ[name] for name in {CHOSEN}])"


@pytest.fixture(scope="session")
def whole(shared, robot_module) -> Path:
    """The small book with an exercise and a trace of each execution, built once; only to read.

    What a build compiles is there by then, so that no two workers compile it at once.
    """
    place = shared / "small"
    with FileLock(shared / "small.lock"):
        if not place.exists():
            small_book(place)
            last = map(new_code_cell, (EXECUTION.format("x"), WHERE, SETTINGS, "print(episodes)"))
            save(place, *far("d = 1.375"), *last)
            result = run(place)
            assert result.returncode == 0, result.stderr
            (place / "said").write_text(result.stdout)
    return place


def outputs(place: Path, name: str = "_build/executed/one.ipynb") -> list[str]:
    """What the cells of an executed chapter printed."""
    cells = nbformat.read(place / name, 4).cells
    code = [cell for cell in cells if cell.cell_type == "code"]
    return [out.text for cell in code for out in cell.outputs if out.output_type == "stream"]


@pytest.mark.slow
def test_a_whole_build_ends_with_the_path_of_the_book(whole):
    assert (whole / "said").read_text().splitlines()[-1] == "_build/html/index.html"
    assert "book/intro.html" in (whole / "_build/html/index.html").read_text()
    assert "300" in (whole / "_build/html/book/one.html").read_text()
    assert (whole / "_build/executed/one.ipynb").exists()
    assert "_repository" not in (whole / "_build/html/book/intro.html").read_text()


@pytest.mark.slow
def test_a_build_that_failed_goes_on_with_what_no_change_of_a_source_has_made_stale(small):
    executions = small / "executions"
    (small / "_build/html").mkdir(parents=True)
    (small / "book/intro.md").write_text("# A small book\n\nSee {doc}`two`.\n")
    save(small, new_code_cell(EXECUTION.format("x")))
    refused = run(small)
    assert refused.returncode == 1
    assert "intro.md:3: WARNING" in refused.stderr
    assert not (small / "_build/html").exists()
    save(small, new_code_cell(EXECUTION.format("y")))
    assert run(small).returncode == 1
    assert executions.read_text() == "xy"
    (small / "book/intro.md").write_text(INTRO)
    last = run(small)
    assert last.returncode == 0, last.stderr
    assert executions.read_text() == "xy"


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has ports only")
def test_a_kernel_has_one_thread_and_no_port_that_another_program_may_take(whole):
    assert '"transport": "ipc"' in "".join(outputs(whole))
    assert "1 1\n" in outputs(whole)


@pytest.mark.skipif(os.name == "nt", reason="Windows has ports only")
def test_no_two_kernels_share_the_files_through_which_they_are_talked_to():
    with execute.sockets() as one, execute.sockets() as other:
        places = [Path(each.KernelManager.ip) for each in (one, other)]
        assert len({place.parent for place in places}) == 2
        assert all(place.parent.is_dir() and not any(place.parent.iterdir()) for place in places)
    assert not any(place.parent.exists() for place in places)


@pytest.mark.slow
def test_a_smoke_build_has_its_own_place_few_episodes_and_says_so_on_every_page(small):
    assert run(small, "--smoke").returncode == 0
    assert not (small / "_build/html").exists()
    pages = [small / f"_build/smoke/html/book/{page}.html" for page in ("intro", "one")]
    assert all("A smoke build" in page.read_text() for page in pages)
    assert outputs(small, "_build/smoke/executed/one.ipynb")[-1] == f"{book.SMOKE['episodes']}\n"


@pytest.mark.slow
def test_a_chapter_is_executed_again_when_it_or_what_it_is_given_has_changed(whole, tmp_path):
    again = shutil.copytree(whole, tmp_path / "again", symlinks=True)
    config = yaml.safe_load((again / "_config.yml").read_text())
    config["repository"]["url"] = "https://github.com/us/book"
    (again / "_config.yml").write_text(yaml.safe_dump(config))
    assert run(again).returncode == 0
    assert (again / "executions").read_text() == "x"
    page = (again / "_build/html/book/one.html").read_text()
    assert '<a href="one.ipynb" download' in page
    assert 'href="https://github.com/us/book"' in page
    assert outputs(again, "_build/html/book/one.ipynb")[-1] == "300\n"
    assert "github.com/us/book" in (again / "_build/html/book/intro.html").read_text()
    (again / "book/one.ipynb").touch()
    assert run(again).returncode == 0
    assert (again / "executions").read_text() == "xx"


@pytest.mark.slow
def test_one_chapter_is_built_apart_with_the_given_parameters(small):
    result = run(small, "--chapter", "one", "-p", "episodes", "7")
    assert result.stdout.splitlines()[-1] == "_build/chapter/one/html/book/one.html"
    assert (
        "Only one was executed for this build, with episodes = 7."
        in (small / "_build/chapter/one/html/book/one.html").read_text()
    )


@pytest.mark.slow
def test_cells_and_solutions_that_fail_are_named_and_no_older_book_survives(small):
    (small / "_build/html").mkdir(parents=True)
    listed(small, "one", "two")
    save(small, new_code_cell("1 / 0"))
    save(small, *far("d = 1.25"), name="two")
    result = run(small)
    assert result.returncode == 1
    assert "one: cell 3 failed with ZeroDivisionError: division by zero" in result.stderr
    assert "Unsolved: That is where the overlap is 0" in result.stderr
    assert "Traceback" not in result.stderr
    assert "ZeroDivisionError" in (small / "_build/logs/one.log").read_text()
    assert not (small / "_build/html").exists()


CONTRADICTION = (
    Verdict("C3", "", REPRODUCED, "", "", ratio=0.55, interval=(0.5, 0.6)),
    Verdict("C3", "", NOT, "", ""),
)


def test_a_verdict_that_contradicts_a_published_one_ends_the_build(monkeypatch):
    """Of times, right after they were measured."""
    from nmpcrl.claims import published
    from nmpcrl.studies import reproduce

    monkeypatch.setattr(published, "load", published.Published)
    monkeypatch.setattr(reproduce, "of_times", lambda timings, known: (timings,))
    with pytest.raises(
        project.Failure, match=r"ones:\nC3 is reproduced \[0.50, 0.60\] here, and not"
    ):
        train.measure((lambda: SimpleNamespace(timings=CONTRADICTION),))


@pytest.mark.slow
def test_a_page_has_an_empty_answer_a_place_for_it_and_the_folded_solution(whole):
    html = (whole / "_build/html/book/one.html").read_text()
    page = BeautifulSoup(html, "html.parser").article
    assert "5 minutes, 1 point." in page.select_one(".exercise").text
    place = page.select_one("div.answer[hidden]")
    assert json.loads(place.script.string)["expected"] == pytest.approx(1.375)
    set_up, answer, *_ = (one.text for one in page.select("details.hide pre"))
    assert "episodes = 300\n\nexperiments = ()" in set_up
    assert "d = ..." in answer
    assert "d = 1.375" in page.select("details")[-1].text
    assert page.text.count("d = 1.375") == 1
    offered = nbformat.read(whole / "_build/html/book/one.ipynb", 4)
    assert [cell.source for cell in offered.cells if "answer" in cell.metadata.get("tags", [])] == [
        "d = ..."
    ]
    assert "Right" not in nbformat.writes(offered)


@pytest.mark.parametrize("value", [True, False, None, 3, -3, 3.5, 1e-7, math.nan, "A", "true", ""])
def test_a_parameter_is_what_papermill_takes_it_for(value):
    taken = chapters.typed(str(value))
    assert type(taken) is type(value)
    assert taken == value or math.isnan(value)
