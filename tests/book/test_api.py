"""The library's pages: what is public has an entry, examples run, and code leads to the entries."""

import ast
import doctest
import inspect
import re
from collections import Counter
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import nbformat
import pytest
from bs4 import BeautifulSoup
from driver import project
from driver.page import enrich, reference

import nmpcrl.learning as learning
from nmpcrl.control import Solution, Task
from nmpcrl.study import Experiment

ROOT = Path(__file__).resolve().parents[2]
SOURCES = {path.stem: path.read_text() for path in sorted((ROOT / "book").glob("api*.md"))}
DIRECTIVE = re.compile(r"^\.\. (auto\w+|py:data):: ([\w.]+)(?:\n   :members: (.*))?$", re.M)
EXPORTING = (
    "control",
    "learning",
    "study",
    "bench",
)  # the rooms whose `__init__` says what is public
DATA = (
    "nmpcrl.Vector",
    "nmpcrl.Matrix",
    "nmpcrl.bench.LENGTHS",
    "nmpcrl.bench.OTHERS",
    "nmpcrl.bench.STEPS",
)
WHOLE = ("analysis", "claims", "report")  # and those of which every public name of a module is


def expanded(text: str) -> str:
    """A page as Sphinx reads it."""
    source = [text]
    reference.each_module(None, "", source)
    return source[0]


PAGES = {page: expanded(text) for page, text in SOURCES.items()}


def module(name: str) -> str:
    return name.rpartition(".")[0]


def public(path: Path) -> list[str]:
    """The functions and classes of a module whose names say that they are for others."""
    nodes = ast.parse(path.read_text()).body
    kinds = (ast.FunctionDef, ast.ClassDef)
    return [node.name for node in nodes if isinstance(node, kinds) and node.name[0] != "_"]


def listed() -> Counter[str]:
    """The names that the pages list, those of whole modules included."""
    found: Counter[str] = Counter()
    for text in PAGES.values():
        for kind, name, _ in DIRECTIVE.findall(text):
            if kind == "automodule":
                path = ROOT / f"{name.replace('.', '/')}.py"
                found.update(f"{name}.{one}" for one in public(path))
            else:
                found[name] += 1
    return found


LISTED = listed()


def test_no_name_has_two_entries():
    assert [name for name, count in LISTED.items() if count > 1] == []


def test_every_page_is_in_the_table_of_contents():
    assert set(PAGES) == {Path(page).stem for page in project.pages() if "/api" in page}


@pytest.mark.parametrize("room", EXPORTING)
def test_every_name_that_a_room_exports_has_an_entry_on_its_page(room):
    exported = import_module(f"nmpcrl.{room}").__all__
    entries = {name for _, name, _ in DIRECTIVE.findall(PAGES[f"api_{room}"])}
    functions = [name for name in exported if name != "paper"]  # a module, listed by its functions
    assert {f"nmpcrl.{room}.{name}" for name in functions} <= entries


@pytest.mark.parametrize("room", WHOLE)
def test_every_module_of_a_room_that_exports_nothing_is_on_its_page(room):
    paths = [path for path in (ROOT / "nmpcrl" / room).rglob("*.py") if path.name[0] != "_"]
    modules = {".".join(path.relative_to(ROOT).with_suffix("").parts) for path in paths}
    assert {name for _, name, _ in DIRECTIVE.findall(PAGES[f"api_{room}"])} == modules


def test_every_entry_is_public_and_begins_with_a_sentence():
    for name in LISTED:
        thing = getattr(import_module(module(name)), name.rpartition(".")[2])
        assert not any(part.startswith("_") for part in name.split(".")), name
        if name not in DATA:  # described on the page itself
            paragraph = (thing.__doc__ or "").partition("\n\n")[0]
            assert paragraph.strip().endswith((".", ":", "?")) or "# departure" in paragraph, name


def test_no_docstring_reads_otherwise_in_the_reference():
    """`shape (m,): the input` of a property would be a type, and an s behind a name no text."""
    for path in sorted((ROOT / "nmpcrl").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.FunctionDef | ast.ClassDef):
                continue
            written = ast.get_docstring(node) or ""
            if any("property" in mark for mark in map(ast.unparse, node.decorator_list)):
                assert ": " not in written.split("\n")[0], node.name
            assert not any(re.findall(r"`[^`\n]+`(\w?)", written)), node.name


def imports(notebook: Path) -> set[str]:
    """What a notebook imports: modules, and names with the module that they come from."""
    cells = [cell for cell in nbformat.read(notebook, 4).cells if cell.cell_type == "code"]
    nodes = [node for cell in cells for node in ast.walk(ast.parse(cell.source))]
    found = {one.name for node in nodes if isinstance(node, ast.Import) for one in node.names}
    chosen = [node for node in nodes if isinstance(node, ast.ImportFrom)]
    return found | {f"{node.module}.{one.name}" for node in chosen for one in node.names}


@pytest.mark.parametrize("page", sorted((ROOT / "book").glob("your_*.ipynb")), ids=lambda p: p.stem)
def test_a_notebook_of_ones_own_uses_public_names_only(page):
    homes = {module(name) for name in LISTED}
    known = {"numpy", "pandas", "casadi", "torch", "functools.partial", "io.StringIO"}
    known |= {"IPython.display.HTML"}
    assert imports(page) - set(LISTED) - homes <= known


def paths() -> set[str]:
    """Where what has an entry is defined, and the public members of classes with it."""
    found = set()
    for name in LISTED:
        thing = getattr(import_module(module(name)), name.rpartition(".")[2], None)
        if hasattr(thing, "__qualname__"):
            path = f"{thing.__module__}.{thing.__qualname__}"
            members = vars(thing) if inspect.isclass(thing) else ()
            found |= {path, *(f"{path}.{one}" for one in members if not one.startswith("_"))}
    return found


def test_functions_of_the_notation_have_entries():
    notation = (ROOT / "book/notation.md").read_text().partition("## Equations\n")[2]
    named = set(re.findall(r"`([a-z_]+\.[\w.]+)`", notation))
    assert len(named) > 40
    known = paths()
    missing = {name for name in named if not any(path.endswith(f".{name}") for path in known)}
    assert missing == set()


@pytest.mark.parametrize("page", PAGES)
def test_the_examples_of_a_page_run_and_show_what_it_says(page, monkeypatch, tmp_path):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))  # nothing is to be stored; if it is, there
    blocks = re.findall(r"^```python\n(.*?)^```$", PAGES[page], flags=re.M | re.S)
    assert blocks
    test = doctest.DocTestParser().get_doctest("\n".join(blocks), {}, page, page, 0)
    assert test.examples
    failures: list[str] = []
    result = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=failures.append)
    assert not result.failed, "".join(failures)
    assert list(tmp_path.iterdir()) == []


@dataclass
class Small:
    """A dataclass."""

    value: float  # V_theta(s), see Eq. (3)
    plain: "int | None" = None
    hidden: int = 0  # departure L


def test_fields_have_their_types_and_the_comments_beside_them():
    assert list(reference._fields(Small)) == [
        "value (float): V_theta(s), see Eq. (3)",
        "plain (int | None): ",
        "hidden (int): # departure L",
    ]
    assert "features (Vector): phi, the value's gradient in theta, shape (2n + m + 1,)" in list(
        reference._fields(Solution)
    )
    assert "seed (int): Seed of the noise and of the network." in list(
        reference._fields(Experiment)
    )


def test_a_constructor_shows_defaults_that_can_be_read():
    assert reference._constructor(Small) == "(value, plain=None, hidden=0)"
    assert "weights=..., robot_diameter=0.5" in reference._constructor(Task)


def test_equations_and_departures_of_a_docstring_become_links():
    assert reference.linked("TD error: Eq. (7).") == "TD error: :ref:`Eq. (7) <paper-7>`."
    assert reference.linked("to Eqs. (2b), (2c) and x (5)") == (
        "to :ref:`Eqs. (2b) <paper-2b>`, :ref:`(2c) <paper-2c>` and x (5)"
    )
    assert reference.linked("As printed.  # departure K") == (
        "As printed. (:ref:`departure K <departure-K>`)"
    )
    assert reference.linked("with |speed| <= 0.6") == r"with \|speed\| <= 0.6"


def article(site: Path, page: str) -> BeautifulSoup:
    return BeautifulSoup((site / f"book/{page}.html").read_text(), "html.parser").article


def test_each_function_of_the_notation_leads_to_its_entry(site):
    rows = article(site, "notation").select("tr")
    numbered = [row for row in rows if re.match(r"\((\d+[a-f]?)\)", row.get_text().strip())]
    assert len(numbered) == 26
    for row in numbered:
        for code in row.select("td")[-1].select("code"):
            target = code.find_parent("a")["href"]
            assert target.startswith("api_")
            assert target.endswith(f".{code.get_text().rpartition('.')[2]}")


def test_an_equation_of_a_docstring_leads_to_its_row(site):
    entry = article(site, "api_learning").find(id="nmpcrl.learning.td_error").find_parent("dl")
    assert [link["href"] for link in entry.select("dd a[href*=notation]")] == [
        "notation.html#paper-7",
        "notation.html#paper-11",
    ]
    assert article(site, "notation").find(id="paper-11").get_text().strip() == "(11)"


def test_what_an_entry_shows_is_what_the_library_has(site):
    shown = article(site, "api_learning")
    for name in learning.__all__:
        assert shown.find(id=f"nmpcrl.learning.{name}"), name
    signature = " ".join(shown.find(id="nmpcrl.learning.td_error").get_text().split())
    assert signature.startswith("td_error(cost: float, gamma: float, q: float, q_next: float)")


def test_no_private_name_has_an_entry(site):
    for page in PAGES:
        for entry in article(site, page).select("dt.sig[id]"):
            last = entry["id"].rpartition(".")[2]
            assert last == "__call__" or not last.startswith("_"), entry["id"]


def test_chapters_lead_to_the_library(site):
    links = article(site, "02_expected_sarsa").select("a[href^=api_] code")
    assert "td_error" in {code.get_text() for code in links}


def test_the_driver_leaves_the_pages_as_they_are():
    """They are MyST already; nothing of `enrich` is to touch a directive or an example."""
    for text in PAGES.values():
        assert enrich.page(text, lambda page, tag: "") == text


def test_every_cell_of_the_comparison_says_how_it_was_checked():
    text = (ROOT / "book/which_library.md").read_text()
    table = text.partition("## Feature by feature\n")[2].partition("\n## ")[0]
    rows = [line.strip("|").split(" | ") for line in table.splitlines() if line.startswith("|")]
    names, _, *features = rows
    assert len(features) > 20
    for row in features:
        assert len(row) == len(names)
        for cell in row[1:]:
            assert re.search(r"\([RSDP]\)$|^not (checked|applicable)$", cell.strip()), cell
    assert re.search(r"written on \d+ \w+ \d{4}", text)
