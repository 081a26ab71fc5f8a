"""What keeps the chapters thin and teachable."""

import ast
import re
import shlex
import subprocess
import sys
from pathlib import Path

import build
import nbformat
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from papermill.cli import papermill

from nmpcrl.study import chapter, paper
from nmpcrl.study.chapter import INJECTED
from nmpcrl.study.experiment import MAIN
from nmpcrl.study.limits import HOURS, MEMORY, estimate

ROOT = Path(__file__).resolve().parents[2]
PATHS = sorted((ROOT / "book").glob("*.ipynb"))
NOTEBOOKS = {path.stem: nbformat.read(path, as_version=4) for path in PATHS}
CHAPTERS = [name for name in NOTEBOOKS if re.match(r"\d\d_|solver", name)]
GIVEN = [*CHAPTERS, "performance"]  # which have parameters

each_notebook = pytest.mark.parametrize("name", NOTEBOOKS)
each_chapter = pytest.mark.parametrize("name", CHAPTERS)
each_given = pytest.mark.parametrize("name", GIVEN)


def code(name: str) -> list:
    return [cell for cell in NOTEBOOKS[name].cells if cell.cell_type == "code"]


def prose(name: str) -> str:
    return "\n\n".join(
        cell.source for cell in NOTEBOOKS[name].cells if cell.cell_type == "markdown"
    )


def tags(cell) -> list[str]:
    return cell.metadata.get("tags", [])


def figures(name: str) -> list:
    return [cell for cell in code(name) if "figure" in cell.metadata.get("mystnb", {})]


def test_the_chapters_are_there_and_in_the_table_of_contents():
    *numbered, last = CHAPTERS
    assert [name[:2] for name in numbered] == [f"{i:02}" for i in range(1, len(numbered) + 1)]
    assert len(numbered) >= 7
    assert last == "solver"
    assert set(NOTEBOOKS) == set(build.notebooks())


@each_notebook
def test_a_notebook_is_valid_and_runs_on_the_kernel_python3(name):
    nbformat.validate(NOTEBOOKS[name])
    kernel = NOTEBOOKS[name].metadata.kernelspec
    assert (kernel.name, kernel.language) == ("python3", "python")


@each_notebook
def test_nothing_that_a_run_produces_is_stored(name):
    for cell in code(name):
        assert not cell.outputs
        assert cell.execution_count is None


@each_notebook
def test_a_cell_has_at_most_20_lines_of_plain_python(name):
    for cell in code(name):
        ast.parse(cell.source)
        assert len(cell.source.splitlines()) <= 20, cell.source


@each_notebook
def test_definitions_are_short_and_there_is_no_class(name):
    for cell in code(name):
        for node in ast.walk(ast.parse(cell.source)):
            assert not isinstance(node, ast.ClassDef), cell.source
            if isinstance(node, ast.FunctionDef):
                assert node.end_lineno - node.lineno < 8, cell.source


@each_notebook
def test_figures_hide_their_code_and_have_a_name_a_caption_and_alt_text(name):
    for cell in figures(name):
        figure, image = cell.metadata.mystnb.figure, cell.metadata.mystnb.get("image", {})
        assert "hide-input" in tags(cell), cell.source
        assert figure.name.startswith("fig:")
        assert figure.caption.strip().endswith(".")
        assert image.get("alt", "").strip(), cell.source


def test_every_label_is_used_once():
    pages = [prose(name) for name in NOTEBOOKS]
    pages += [path.read_text() for path in sorted((ROOT / "book").glob("*.md"))]
    text = "\n".join(pages)
    labels = re.findall(r"^:label: (\S+)$|^\((\S+)\)=$|\$\$ \((\S+)\)$", text, flags=re.M)
    names = [one for groups in labels for one in groups if one]
    names += [cell.metadata.mystnb.figure.name for name in NOTEBOOKS for cell in figures(name)]
    assert sorted(names) == sorted(set(names))


@each_chapter
def test_the_first_code_cell_and_no_other_holds_the_parameters(name):
    assert ["parameters" in tags(cell) for cell in code(name)] == [True] + [False] * (
        len(code(name)) - 1
    )


@each_chapter
def test_the_second_code_cell_refuses_parameters_that_make_no_sense(name):
    path = ROOT / f"book/{name}.ipynb"
    nonsense = {"episodes": 0, "seeds": "[3]", "layout": "nowhere"}
    for parameter in build.parameters(path):
        if parameter in nonsense:
            with pytest.raises(build.Failure, match=parameter):
                build.ask(path, {parameter: nonsense[parameter]})


@each_given
def test_the_parameters_are_declared_in_the_metadata_and_all_are_checked(name):
    """The second cell refuses names that it does not check, so it may leave none out."""
    declared = build.parameters(ROOT / f"book/{name}.ipynb")
    assert NOTEBOOKS[name].metadata.nmpcrl.parameters == declared
    assert not code(name)[0].source.startswith(INJECTED)
    shown: dict = {}
    exec(code(name)[0].source, shown)
    check = chapter.check
    try:
        chapter.check = lambda **given: shown.update(checked=given)
        build.ask(ROOT / f"book/{name}.ipynb", {})
    finally:
        chapter.check = check
    assert shown["checked"] == {one: shown[one] for one in declared}


def test_a_notebook_without_parameters_declares_none():
    for name in set(NOTEBOOKS) - set(GIVEN):
        assert "nmpcrl" not in NOTEBOOKS[name].metadata
        assert build.parameters(ROOT / f"book/{name}.ipynb") == []


MAY_BE = {  # what is drawn for a parameter, so that it is sometimes right
    "episodes": st.integers(0, 300) | st.integers(1, 200_000),
    "seeds": st.lists(st.integers(-1, 20), max_size=3, unique=True),
    "layout": st.sampled_from([*paper.LAYOUTS, "Z"]),
    "layouts": st.lists(st.sampled_from([*paper.LAYOUTS, "Z"]), max_size=3, unique=True),
    "learners": st.lists(st.sampled_from([*MAIN, "QL", "SARSA"]), max_size=4),
    "alpha": st.floats(0, 1e-3) | st.floats(),
    "beta": st.floats(0, 1e-3) | st.floats(),
    "horizon": st.integers(-1, 30) | st.integers(),
    "seed": st.integers(),
    "study": st.sampled_from(["fresh", "published", "stale"]),
    "budget": st.integers(0, 10**7),
    "length": st.sampled_from(["smoke", "short", "full", "long"]),
}
LARGE = [10**400, -(10**20), 2**31, 100_000, 10**12, 1e308, 5e-324]
ANYTHING = st.recursive(  # that JSON or YAML can hold
    st.none()
    | st.booleans()
    | st.integers(-2, 2)
    | st.floats()
    | st.text(max_size=4)
    | st.dates()
    | st.sampled_from([*LARGE, "A", "[3]", "[A]", " 3", list(range(100_000)), [0] * 20_000]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=2), inner),
    max_leaves=5,
)


@st.composite
def asked(draw):
    """A chapter and what it is given, some of it right."""
    name = draw(st.sampled_from(GIVEN))
    names = st.sampled_from(build.parameters(ROOT / f"book/{name}.ipynb"))
    chosen = draw(st.lists(names, unique=True, min_size=1))
    values = {one: draw(MAY_BE[one] | MAY_BE[one] | MAY_BE[one] | ANYTHING) for one in chosen}
    if draw(st.integers(0, 9)) == 0:
        values[draw(st.sampled_from(["episode", "open", "Seeds", "x"]))] = draw(ANYTHING)
    return name, values


@pytest.mark.slow
@settings(derandomize=True, deadline=None, max_examples=1500)
@given(asked())
def test_whatever_a_chapter_is_given_it_takes_little_or_refuses_in_a_sentence(drawn):
    name, values = drawn
    try:
        needs = build.ask(ROOT / f"book/{name}.ipynb", values)
    except build.Failure as refusal:
        said = refusal.message
        assert "\n" not in said
        assert len(said) < 400
        return
    cost = estimate((*needs["experiments"], *needs["summaries"]))
    assert cost.seconds <= HOURS * 3600
    assert cost.memory <= MEMORY


@pytest.mark.slow
@pytest.mark.book
@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("02_expected_sarsa", ["-p", "episode", "2"], "(did you mean 'episodes'?)"),
        ("02_expected_sarsa", ["-p", "episodes", "100000000"], "from 1 to 100000"),
        ("02_expected_sarsa", ["-y", "{seeds: 3}"], "seeds = 3 must be a list, such as [3]"),
        ("03_rdes", ["-y", "{layout: [A]}"], "layout = ['A'] must be one of A, B"),
        ("04_ges", ["-p", "episodes", "90000"], "GB of memory; 4 GB are allowed"),
        ("06_what_the_paper_leaves_open", ["-p", "layouts", "A"], "must be a list, such as ['A']"),
        ("07_beyond", ["-p", "budget", "1000000000"], "budget = 1000000000 must be a whole"),
        ("01_mdp_and_nmpc", ["-p", "horizon", "21"], "must be 20 or less here: a longer plan"),
        ("performance", ["-p", "lenght", "smoke"], "(did you mean 'length'?)"),
        ("solver", ["-p", "horizon", "1000000000000"], "from 1 to 500"),
    ],
)
def test_papermill_itself_ends_in_the_sentence_before_anything_is_trained(
    name, words, said, tmp_path, monkeypatch
):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    output = tmp_path / "o.ipynb"
    command = [sys.executable, "-m", "papermill", f"book/{name}.ipynb", str(output), *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("ParameterError: ")
    assert said in last
    (error,) = [
        one
        for cell in nbformat.read(output, 4).cells
        if cell.cell_type == "code"
        for one in cell.outputs
        if one.output_type == "error"
    ]
    assert error.traceback == [last]
    assert not (tmp_path / "runs").exists()


@each_chapter
def test_a_chapter_names_its_learning_goals(name):
    assert re.search(r"\{admonition\} Learning goals\n", prose(name))


@each_chapter
def test_every_exercise_has_a_cell_that_checks_and_a_folded_solution(name):
    cells = NOTEBOOKS[name].cells
    text = "\n\n".join(f"\n{cell.source}" for cell in cells)
    exercises = re.findall(r"^:{3,}\{exercise\}.*\n:label: (\S+)$", text, flags=re.M)
    solutions = re.findall(r"^:{3,}\{solution\} (\S+)\n:class: dropdown$", text, flags=re.M)
    assert len(exercises) >= 2
    assert exercises == solutions
    for label in exercises:
        between = text.split(f":label: {label}\n")[1].split(f"{{solution}} {label}\n")[0]
        assert re.search(r"^assert ", between, flags=re.M), label


def commands(name: str) -> list[list[str]]:
    """The command lines of the Try box, each split as a shell would."""
    box = re.search(r"^(:{3,})\{admonition\} Try\n(.*?)^\1$", prose(name), flags=re.M | re.S)
    assert box, "there is no Try box"
    lines = re.sub(r"\\\n", " ", box[2]).splitlines()
    return [shlex.split(line) for line in lines if re.match(r"(papermill|make chapter) ", line)]


def chapter_and_parameters(words: list[str]) -> tuple[str, dict]:
    """What one command of a Try box asks for, read by papermill's or the driver's own parser."""
    if words[0] == "papermill":
        given = papermill.make_context("papermill", words[1:]).params
        pairs, raw, texts = (given[f"parameters{suffix}"] for suffix in ("", "_raw", "_yaml"))
        return given["notebook_path"], build.values(pairs, raw, texts)
    named = dict(word.split("=", 1) for word in words[2:])
    given = build.main.make_context("build", shlex.split(named.get("P", ""))).params
    return named["CHAPTER"], build.values(given["pairs"], given["raw"], given["texts"])


@each_chapter
def test_the_commands_of_the_try_box_are_accepted(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    lines = commands(name)
    assert any(words[0] == "papermill" for words in lines)
    for words in lines:
        chapter, given = chapter_and_parameters(words)
        build.refuse_unknown(build.known(chapter), given)
        build.ask(build.known(chapter), given)
