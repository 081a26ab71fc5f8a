"""What keeps the chapters thin and teachable."""

import ast
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from textwrap import dedent

import nbformat
import pytest
from click.testing import CliRunner
from driver import project
from driver.build import book, chapters
from driver.page.prose import calls_prose, says
from papermill.cli import papermill

from nmpcrl.course.exercises import exercises
from nmpcrl.study import chapter
from nmpcrl.study.chapter import INJECTED

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


def lines_of_code(cell) -> int:
    """The lines of a cell, without those of the prose that it says."""
    calls = [node for node in ast.walk(ast.parse(cell.source)) if isinstance(node, ast.Call)]
    said = [one.args[0] for one in calls if getattr(one.func, "id", "") == "say"]
    return len(cell.source.splitlines()) - sum(one.end_lineno - one.lineno for one in said)


def definitions(cell) -> list[ast.AST]:
    """The classes of a cell, and its functions of more than eight lines."""
    found = [node for node in ast.walk(ast.parse(cell.source)) if isinstance(node, ast.stmt)]
    long = [one for one in found if isinstance(one, ast.FunctionDef)]
    long = [one for one in long if one.end_lineno - one.lineno >= 8]
    return long + [one for one in found if isinstance(one, ast.ClassDef)]


HIDDEN = {"jupyter": {"source_hidden": True}}  # the call that says a paragraph
RULES = {  # of each cell with code
    "has no output": lambda cell: not cell.outputs and cell.execution_count is None,
    "has at most 20 lines": lambda cell: lines_of_code(cell) <= 20,
    "defines little": lambda cell: definitions(cell) == [],
    "says or lists and does nothing else": lambda cell: (
        calls_prose(cell.source) or not re.search(r"^(say|source)\(", cell.source, flags=re.M)
    ),
    "is hidden by an editor if it says a paragraph": lambda cell: (
        {key: cell.metadata[key] for key in ("jupyter",) if key in cell.metadata}
        == (HIDDEN if says(cell.source) else {})
    ),
    "hides its code if it draws": lambda cell: (
        "mystnb" not in cell.metadata
        or ("hide-input" in tags(cell) and cell.metadata.mystnb.image.alt.strip())
    ),
}


def test_the_chapters_are_there_and_in_the_table_of_contents():
    *numbered, last = CHAPTERS
    assert [name[:2] for name in numbered] == [f"{i:02}" for i in range(1, len(numbered) + 1)]
    assert (last, set(NOTEBOOKS)) == ("solver", set(project.notebooks()))


@each_notebook
def test_a_notebook_is_valid_and_each_cell_of_code_keeps_the_rules(name):
    nbformat.validate(NOTEBOOKS[name])
    assert NOTEBOOKS[name].metadata.kernelspec.name == "python3"
    broken = [(rule, cell.source) for cell in code(name) for rule in RULES if not RULES[rule](cell)]
    assert broken == []


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
    yield from re.findall(r".*\$.*", re.sub(INLINE, "", words))  # which begins or ends no formula
    for block in re.findall(r"^<.*?(?=\n\n|\Z)", words, flags=re.M | re.S):
        if not block.startswith("<a "):  # inline: what follows is Markdown
            yield from re.findall(INLINE, block)
    for row in re.findall(r"^ *\|.*", words, flags=re.M):  # where a bar ends a cell
        yield from (formula for formula in re.findall(INLINE, row) if "|" in formula)


@each_notebook
def test_formulas_links_and_html_are_those_that_every_editor_knows(name):
    """VS Code has KaTeX for formulas, and markdown-it for the rest."""
    assert [one for text in texts(NOTEBOOKS[name].cells) for one in unreadable(text)] == []
    elements = set(re.findall(r"</?([a-z]+)[ >]", re.sub(r"`[^`]*`", "", prose(name))))
    assert elements <= {"a", "details", "summary", "br", "code", "sup", "sub"}


@each_notebook
def test_every_figure_has_a_caption_with_its_name(name):
    captions = tagged(name, "caption")
    assert len(captions) == sum("mystnb" in cell.metadata for cell in code(name))
    for one in captions:
        assert re.fullmatch(
            r'<a id="fig-[\w-]+"></a>\n\*\*Fig\. [\d.]+\*\* .*\.', one.source, flags=re.S
        )


@each_chapter
def test_the_parameters_are_in_the_first_code_cell_declared_and_all_checked(name):
    """The second cell refuses names that it does not check, so it may leave none out."""
    first, *others = code(name)
    assert "parameters" in tags(first)
    assert not any("parameters" in tags(cell) for cell in others)
    assert not first.source.startswith(INJECTED)
    declared = chapters.parameters(ROOT / f"book/{name}.ipynb")
    assert NOTEBOOKS[name].metadata.nmpcrl.parameters == declared
    shown: dict = {}
    exec(first.source, shown)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chapter, "check", lambda **given: shown.update(checked=given))
        chapters.ask(ROOT / f"book/{name}.ipynb", {})
    assert shown["checked"] == {one: shown[one] for one in declared}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("02_expected_sarsa", ["-p", "episode", "2"], "(did you mean 'episodes'?)"),
        ("02_expected_sarsa", ["-y", "{seeds: 3}"], "seeds = 3 must be a list, such as [3]"),
        ("01_mdp_and_nmpc", ["-p", "horizon", "21"], "must be 20 or less here: a longer plan"),
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
    shown = (one for cell in nbformat.read(output, 4).cells for one in cell.get("outputs", ()))
    assert [one.traceback for one in shown if one.output_type == "error"] == [[last]]
    assert not (tmp_path / "runs").exists()


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
