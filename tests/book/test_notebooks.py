"""What keeps the chapters thin and teachable."""

import ast
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from textwrap import dedent

import nbformat
import pytest
from click.testing import CliRunner
from driver import project
from driver.build import book, chapters
from driver.page.prose import calls_prose, says
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from papermill.cli import papermill

from nmpcrl.course.exercises import exercises
from nmpcrl.report.prose import listing
from nmpcrl.study import chapter, paper
from nmpcrl.study.chapter import INJECTED
from nmpcrl.study.experiment import MAIN
from nmpcrl.study.limits import afford

ROOT = Path(__file__).resolve().parents[2]
PATHS = sorted((ROOT / "book").glob("*.ipynb"))
NOTEBOOKS = {path.stem: nbformat.read(path, as_version=4) for path in PATHS}
CHAPTERS = [name for name in NOTEBOOKS if re.match(r"\d\d_|solver", name)]

each_notebook = pytest.mark.parametrize("name", NOTEBOOKS)
each_chapter = pytest.mark.parametrize("name", CHAPTERS)


def code(name: str) -> list:
    return [cell for cell in NOTEBOOKS[name].cells if cell.cell_type == "code"]


def prose(name: str) -> str:
    return "\n\n".join(
        cell.source for cell in NOTEBOOKS[name].cells if cell.cell_type == "markdown"
    )


def tags(cell) -> list[str]:
    return cell.metadata.get("tags", [])


def tagged(name: str, tag: str) -> list:
    return [cell for cell in NOTEBOOKS[name].cells if tag in tags(cell)]


def figures(name: str) -> list[tuple]:
    """The cells that draw, each with the caption that follows it."""
    pairs = pairwise(NOTEBOOKS[name].cells)
    return [(figure, caption) for figure, caption in pairs if "caption" in tags(caption)]


def lines_of_code(source: str) -> int:
    """The lines of a cell, without those of the prose that it says."""
    count = len(source.splitlines())
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "say":
            count -= node.args[0].end_lineno - node.args[0].lineno
    return count


def test_the_chapters_are_there_and_in_the_table_of_contents():
    *numbered, last = CHAPTERS
    assert [name[:2] for name in numbered] == [f"{i:02}" for i in range(1, len(numbered) + 1)]
    assert len(numbered) >= 9
    assert last == "solver"
    assert set(NOTEBOOKS) == set(project.notebooks())


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
        assert lines_of_code(cell.source) <= 20, cell.source


@each_notebook
def test_prose_with_numbers_and_shown_source_have_cells_of_their_own(name):
    for cell in code(name):
        if re.search(r"^(say|source)\(", cell.source, flags=re.M):
            assert calls_prose(cell.source), cell.source


@each_notebook
def test_an_editor_hides_the_call_that_says_a_paragraph_and_no_other_code(name):
    hidden = {"jupyter": {"source_hidden": True}}
    for cell in code(name):
        shown = {key: cell.metadata[key] for key in ("jupyter",) if key in cell.metadata}
        assert shown == (hidden if says(cell.source) else {}), cell.source


PAGE_ONLY = {  # what only the page would know, and a notebook editor shows as it is written
    "a role": r"\{[\w:.-]+\}`",
    "a directive": r"^ *(```+|:::+)\{",
    "a box of colons": r"^ *:{3,}",
    "a label": r"^\([\w:-]+\)=|\$\$ *\([\w:-]+\) *$",
    "a definition list": r"^ *: ",
    "attributes": r"\]\{[.#]|\)\{[.#]|^\{[.#]",
    "a substitution": r"\{\{",
    "a comment of MyST": r"^%",
    "a macro of our own": r"\\(v[saxuw]|vtheta|vphi|vpi|vsigma|vomega|vnn|E|T)(?![A-Za-z])",
    "a number from a cell elsewhere": r"\bglue\b",
}


@each_notebook
@pytest.mark.parametrize("what", PAGE_ONLY)
def test_a_source_has_nothing_that_only_the_page_can_show(name, what):
    for cell in NOTEBOOKS[name].cells:
        shown = cell.cell_type == "markdown" or calls_prose(cell.source)
        if shown or what.startswith("a number"):
            assert not re.search(PAGE_ONLY[what], dedent(cell.source), flags=re.M), cell.source
        assert "figure" not in cell.metadata.get("mystnb", {})


MACROS = re.findall(  # KaTeX of VS Code has them, and so has MathJax of JupyterLab and of the page
    r"\w+",
    """
    alpha beta gamma delta epsilon varepsilon zeta eta theta vartheta kappa lambda mu nu pi varpi
    rho varrho sigma varsigma phi varphi omega Gamma Delta Xi Pi Upsilon ell gimel partial nabla
    approx ge gg in infty le leftarrow mapsto mid subseteq to cdot pm star times top
    arg cos log max min sin operatorname sum binom dot frac hat sqrt tfrac underbrace
    left right lVert rVert bigl bigr Bigl Bigr dots quad qquad
    boldsymbol mathbb mathbf mathcal mathrm text textstyle begin end tag
    """,
)
ENVIRONMENTS = {"aligned", "cases", "pmatrix"}
BLOCK, INLINE = r"\$\$.+?\$\$", r"\$[^$]+\$"
CODE = re.compile(r"^```.*?^```|`[^`\n]*`", flags=re.M | re.S)


def texts(cells: list) -> list[str]:
    """All Markdown of a notebook, that of its calls of `say` included, without code."""
    found = []
    for cell in cells:
        if cell.cell_type == "markdown":
            found.append(cell.source)
        elif says(cell.source):
            calls = [
                node for node in ast.walk(ast.parse(cell.source)) if isinstance(node, ast.Call)
            ]
            said = [one.args[0].value for one in calls if getattr(one.func, "id", "") == "say"]
            found += [dedent(one).replace("{{", "{").replace("}}", "}") for one in said]
    return [CODE.sub("code", one) for one in found]


def unreadable(text: str) -> Iterator[str]:
    """What VS Code would show as it is written, or not at all."""
    for formula in re.findall(f"{BLOCK}|{INLINE}", text, flags=re.S):
        yield from sorted(set(re.findall(r"\\([A-Za-z]+)", formula)).difference(MACROS))
        yield from sorted(set(re.findall(r"\\begin\{(.*?)\}", formula)) - ENVIRONMENTS)
    words = re.sub(BLOCK, "", text, flags=re.S)
    for found in re.finditer(INLINE, words):  # a letter or a digit at a dollar sign
        around = words[: found.start()][-1:] + words[found.end() :][:1]
        if re.search(r"\w", around):
            yield found[0]
    yield from re.findall(r".*\$.*", re.sub(INLINE, "", words))  # which begins or ends no formula
    for block in re.findall(r"^<.*?(?=\n\n|\Z)", words, flags=re.M | re.S):
        if not block.startswith("<a "):  # inline: what follows is Markdown
            yield from re.findall(INLINE, block)
    for row in re.findall(r"^ *\|.*", words, flags=re.M):  # where a bar ends a cell
        yield from (formula for formula in re.findall(INLINE, row) if "|" in formula)
    for place in re.findall(r"\]\(#(.*?)\)", words):  # VS Code's links have no other characters
        if re.search("[^a-z0-9-]", place):
            yield place


@each_notebook
def test_formulas_and_links_are_those_that_every_editor_knows(name):
    """VS Code has KaTeX for formulas, and markdown-it for the rest."""
    assert [one for text in texts(NOTEBOOKS[name].cells) for one in unreadable(text)] == []


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (r"$\eqref{a}$ and $x$", ["eqref"]),
        ("$$\n\\begin{multline}\na\n\\end{multline}\n$$", ["multline"]),
        ("the $n$th", ["$n$"]),
        ("It costs 5 $.", ["It costs 5 $."]),
        ("| $|x|$ | $y$ |", ["$|x|$"]),
        ("<details><summary>Why $x$</summary>\n\n$y$\n\n</details>", ["$x$"]),
        ('<a id="eq-a"></a>\n$x$', []),
        ("[Eq. (1.1)](#eq:a) and [Eq. (1.2)](#eq-b)", ["eq:a"]),
        ("$x$-axis, $$y$$ and ($z$).", []),
    ],
)
def test_what_vs_code_cannot_show_is_found(text, found):
    assert list(unreadable(text)) == found


@each_notebook
def test_html_in_prose_is_what_every_editor_shows(name):
    elements = set(re.findall(r"</?([a-z]+)[ >]", re.sub(r"`[^`]*`", "", prose(name))))
    assert elements <= {"a", "details", "summary", "br", "code", "sup", "sub"}


@each_notebook
def test_a_notebook_shows_definitions_that_are_there(name):
    every = "\n".join(cell.source for cell in code(name))
    for shown in re.findall(r'source\("([\w.]+:[\w.]+)"', every):
        assert "```python" in listing(shown)


@each_notebook
def test_definitions_are_short_and_there_is_no_class(name):
    for cell in code(name):
        for node in ast.walk(ast.parse(cell.source)):
            assert not isinstance(node, ast.ClassDef), cell.source
            if isinstance(node, ast.FunctionDef):
                assert node.end_lineno - node.lineno < 8, cell.source


@each_notebook
def test_no_figure_is_described_by_an_ink_that_the_dark_theme_inverts(name):
    described = [cell.metadata["mystnb"]["image"]["alt"] for cell, _ in figures(name)]
    described += [cell.source for cell in tagged(name, "caption")]
    assert [said for said in described if re.search(r"\b(black|white)\b", said, re.I)] == []


@each_notebook
def test_figures_hide_their_code_and_have_a_name_a_caption_and_alt_text(name):
    assert len(figures(name)) == sum("mystnb" in cell.metadata for cell in code(name))
    for figure, caption in figures(name):
        assert "hide-input" in tags(figure), figure.source
        assert re.fullmatch(
            r'<a id="fig-[\w-]+"></a>\n\*\*Fig\. [\d.]+\*\* .*\.', caption.source, flags=re.S
        )
        assert figure.metadata.mystnb.image.alt.strip(), figure.source


@each_chapter
def test_the_first_code_cell_and_no_other_holds_the_parameters(name):
    assert ["parameters" in tags(cell) for cell in code(name)] == [True] + [False] * (
        len(code(name)) - 1
    )


@each_chapter
def test_the_second_code_cell_refuses_parameters_that_make_no_sense(name):
    path = ROOT / f"book/{name}.ipynb"
    nonsense = {"episodes": 0, "seeds": "[3]", "layout": "nowhere"}
    for parameter in chapters.parameters(path):
        if parameter in nonsense:
            with pytest.raises(project.Failure, match=parameter):
                chapters.ask(path, {parameter: nonsense[parameter]})


@each_chapter
def test_the_parameters_are_declared_in_the_metadata_and_all_are_checked(name):
    """The second cell refuses names that it does not check, so it may leave none out."""
    declared = chapters.parameters(ROOT / f"book/{name}.ipynb")
    assert NOTEBOOKS[name].metadata.nmpcrl.parameters == declared
    assert not code(name)[0].source.startswith(INJECTED)
    shown: dict = {}
    exec(code(name)[0].source, shown)
    check = chapter.check
    try:
        chapter.check = lambda **given: shown.update(checked=given)
        chapters.ask(ROOT / f"book/{name}.ipynb", {})
    finally:
        chapter.check = check
    assert shown["checked"] == {one: shown[one] for one in declared}


def test_a_notebook_without_parameters_declares_none():
    for name in set(NOTEBOOKS) - set(CHAPTERS):
        assert "nmpcrl" not in NOTEBOOKS[name].metadata
        assert chapters.parameters(ROOT / f"book/{name}.ipynb") == []


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
    "entry": st.sampled_from(["ES", "CMA-ES", "SARSA"]),
    "overshot": st.lists(st.sampled_from([*paper.LAYOUTS, "Z"]), max_size=3, unique=True),
    "overshot_episodes": st.integers(0, 400),
    "scenario": st.sampled_from(["M01", "M40", "M41", "A"]),
    "theta_c": st.floats(-0.1, 0.5),
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
    name = draw(st.sampled_from(CHAPTERS))
    names = st.sampled_from(chapters.parameters(ROOT / f"book/{name}.ipynb"))
    chosen = draw(st.lists(names, unique=True, min_size=1))
    values = {one: draw(MAY_BE[one] | MAY_BE[one] | MAY_BE[one] | ANYTHING) for one in chosen}
    if draw(st.integers(0, 9)) == 0:
        values[draw(st.sampled_from(["episode", "open", "Seeds", "x"]))] = draw(ANYTHING)
    return name, values


@pytest.fixture
def read_once(monkeypatch):
    """Notebooks that nobody writes are read, by nbformat and by papermill, once."""
    monkeypatch.setattr(chapters.nbformat, "read", cache(nbformat.read))
    monkeypatch.setattr(chapters, "parameters", cache(chapters.parameters))


@pytest.mark.slow
@pytest.mark.usefixtures("read_once")
@settings(
    derandomize=True,
    deadline=None,
    max_examples=1500,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(asked())
def test_whatever_a_chapter_is_given_it_takes_little_or_refuses_in_a_sentence(drawn):
    name, values = drawn
    try:
        needs = chapters.ask(ROOT / f"book/{name}.ipynb", values)
    except project.Failure as refusal:
        said = refusal.message
        assert "\n" not in said
        assert len(said) < 400
        return
    afford((*needs.experiments, *needs.summaries))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("02_expected_sarsa", ["-p", "episode", "2"], "(did you mean 'episodes'?)"),
        ("02_expected_sarsa", ["-y", "{seeds: 3}"], "seeds = 3 must be a list, such as [3]"),
        ("04_ges", ["-p", "episodes", "90000"], "4,000,000 are allowed"),
        ("05_results", ["-p", "layouts", "A"], "must be a list, such as ['A']"),
        ("07_what_to_try_first", ["-p", "budget", "1000"], "budget = 1000 must be a whole"),
        ("01_mdp_and_nmpc", ["-p", "horizon", "21"], "must be 20 or less here: a longer plan"),
        ("solver", ["-p", "horizon", "1000000000000"], "from 1 to 500"),
    ],
)
def test_papermill_itself_ends_in_the_sentence_before_anything_is_trained(
    name, words, said, tmp_path, monkeypatch
):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    output = tmp_path / "o.ipynb"
    monkeypatch.chdir(ROOT)
    done = CliRunner().invoke(papermill, [f"book/{name}.ipynb", str(output), *words])
    assert done.exit_code != 0
    last = str(done.exception).strip().splitlines()[-1]
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
    (goals,) = tagged(name, "goals")
    assert goals.source.startswith("**Learning goals.** After this chapter you can\n\n- ")


@each_chapter
def test_an_answer_is_empty_and_its_check_is_one_call_of_the_course(name):
    checks = import_module("nmpcrl.course.checks." + re.sub(r"^\d\d_", "", name))
    for one in exercises(NOTEBOOKS[name]):
        (answer,), (check,) = one.parts["answer"], one.parts["check"]
        called = re.fullmatch(r"check\.(\w+)\((\w+)[^\n]*\)", check.source)
        assert callable(getattr(checks, called[1])), one.number
        empty, _, solution = answer.source.partition("### BEGIN SOLUTION\n")
        for code in (empty, solution):
            assert re.search(rf"^(def )?{called[2]}\b", code, flags=re.M), one.number


def commands(name: str) -> list[list[str]]:
    """The command lines of the Try box, each split as a shell would."""
    (box,) = tagged(name, "try")
    assert box.source.startswith("**Try.** ")
    lines = re.sub(r"\\\n", " ", box.source).splitlines()
    return [shlex.split(line) for line in lines if re.match(r"(papermill|make chapter) ", line)]


def chapter_and_parameters(words: list[str]) -> tuple[str, dict]:
    """What one command of a Try box asks for, read by papermill's or the driver's own parser."""
    if words[0] == "papermill":
        given = papermill.make_context("papermill", words[1:]).params
        pairs, raw, texts = (given[f"parameters{suffix}"] for suffix in ("", "_raw", "_yaml"))
        return given["notebook_path"], chapters.values(pairs, raw, texts)
    named = dict(word.split("=", 1) for word in words[2:])
    given = book.main.make_context("build", shlex.split(named.get("P", ""))).params
    return named["CHAPTER"], chapters.values(given["pairs"], given["raw"], given["texts"])


@pytest.mark.parametrize("name", CHAPTERS)
def test_the_commands_of_the_try_box_are_accepted(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    lines = commands(name)
    assert any(words[0] == "papermill" for words in lines)
    for words in lines:
        chapter, given = chapter_and_parameters(words)
        chapters.refuse_unknown(chapters.known(chapter), given)
        chapters.ask(chapters.known(chapter), given)


def assert_runs(name: str, tmp_path: Path, monkeypatch, **few) -> None:
    """Papermill executes a notebook with those of these parameters that it has."""
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    given = {one: few[one] for one in NOTEBOOKS[name].metadata.nmpcrl.parameters if one in few}
    command = [sys.executable, "-m", "papermill", f"book/{name}.ipynb", str(tmp_path / "o.ipynb")]
    done = subprocess.run(
        [*command, "-y", str(given)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


CENTRES = [[x, y] for y in (3.6, 0.2, 6.6, -2.9) for x in (0.2, 3.0, 5.8, -2.9)]
WITH_CENTRES = [
    one
    for one in CHAPTERS
    if "layout" in (names := NOTEBOOKS[one].metadata.nmpcrl.parameters)
    if "layouts" not in names
]


@pytest.mark.slow
def test_chapter_1_runs_with_one_obstacle(tmp_path, monkeypatch):
    assert_runs("01_mdp_and_nmpc", tmp_path, monkeypatch, layout=[[0, 2]])


@pytest.mark.slow
@pytest.mark.weekly
@pytest.mark.parametrize("count", [1, 2, 5, 16])
@pytest.mark.parametrize("name", WITH_CENTRES)
def test_a_chapter_runs_with_any_number_of_obstacles(name, count, tmp_path, monkeypatch):
    few = {"episodes": 4, "seeds": [3], "overshot": ["B"], "overshot_episodes": 2}
    assert_runs(name, tmp_path, monkeypatch, layout=CENTRES[:count], **few)


@pytest.mark.slow
def test_a_learner_of_ones_own_runs_with_few_episodes_and_one_seed(tmp_path, monkeypatch):
    assert_runs("09_your_own", tmp_path, monkeypatch, episodes=2, seeds=[3])
    kept = {path.name for path in (tmp_path / "runs").glob("[!.]*")}
    assert kept <= {"trials"}  # nothing of it belongs to the study


@pytest.mark.slow
def test_the_forty_lines_of_chapter_9_are_a_script_that_learns_the_mass(tmp_path):
    cells = {cell.id: cell.source for cell in code("09_your_own")}
    script = "\n".join(cells[f"drone-{part}"] for part in ("model", "problem", "learned"))
    assert sum(bool(line.strip()) for line in script.splitlines()) <= 40
    (tmp_path / "drone.py").write_text(script)
    command = [sys.executable, str(tmp_path / "drone.py")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert abs(ast.literal_eval(done.stdout)["mass"] - 1.3) < 0.05
