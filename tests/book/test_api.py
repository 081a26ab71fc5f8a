"""The library's pages: what is public has an entry, and the examples run."""

import doctest
import re
from importlib import import_module
from pathlib import Path

import pytest
from bs4 import BeautifulSoup

ROOT = Path(__file__).resolve().parents[2]
PAGES = {path.stem: path.read_text() for path in sorted((ROOT / "book").glob("api_*.md"))}
DIRECTIVE = re.compile(r"^\.\. auto(\w+):: ([\w.]+)$", re.M)
EXPORTING = ("control", "learning", "study")  # the packages whose `__init__` says what is public


def entries(text: str) -> set[str]:
    """The names that a page describes, those of whole modules included."""
    found, shown = set(), re.findall(r"^```\{eval-rst\}\n(.*?)^```$", text, flags=re.M | re.S)
    for kind, name in DIRECTIVE.findall("".join(shown)):
        found.add(name)
        if kind == "module":
            found |= {f"{name}.{one}" for one in vars(import_module(name)) if one[0] != "_"}
    return found


@pytest.mark.parametrize("room", EXPORTING)
def test_every_name_that_a_package_exports_has_an_entry_on_its_page(room):
    functions = {name for name in import_module(f"nmpcrl.{room}").__all__ if name != "paper"}
    assert {f"nmpcrl.{room}.{name}" for name in functions} <= entries(PAGES[f"api_{room}"])


@pytest.mark.parametrize("page", PAGES)
def test_the_examples_of_a_page_run_and_show_what_it_says(page, monkeypatch, tmp_path):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))  # nothing is to be stored; if it is, there
    blocks = re.findall(r"^```python\n(.*?)^```$", PAGES[page], flags=re.M | re.S)
    test = doctest.DocTestParser().get_doctest("\n".join(blocks), {}, page, page, 0)
    assert test.examples
    failures: list[str] = []
    result = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=failures.append)
    assert not result.failed, "".join(failures)
    assert list(tmp_path.iterdir()) == []


def test_the_built_page_has_signatures_and_the_comments_beside_fields(site):
    html = (site / "book/api_control.html").read_text()
    article = BeautifulSoup(html, "html.parser").article
    solve = article.find(id="nmpcrl.control.Nmpc.solve").get_text(" ", strip=True)
    assert "state : Array" in solve
    features = article.find(id="nmpcrl.control.Solution.features").parent.get_text(" ", strip=True)
    assert "phi, the value’s gradient in theta, shape (2n + m + 1,)" in features
