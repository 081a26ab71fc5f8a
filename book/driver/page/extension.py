"""A Sphinx extension: what this book needs that Sphinx, MyST-NB and pandas leave out."""

import re
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

from driver.project import ROOT

DEPARTURE = re.compile(r"\s*# departure ([A-Z])")
FLOATS = "~numpy.ndarray[tuple[~typing.Any, ...], ~numpy.dtype[~numpy.float64]]"
OBJECT = re.compile(r"<(?:[^<>]|<[^<>]*>)*>")  # `<factory>` or `<function ...>`
TABLE = re.compile(r"<table\b.*?</table>", flags=re.S)
PARAMETERS = re.compile(r'<dt class="sig\b.*?</dt>', flags=re.S)
SIDEBAR = '<div id="pst-primary-sidebar"'
SHORT = "ndarray[tuple[Any, ...], dtype[float64]]"


def setup(app: Sphinx) -> dict[str, bool]:
    """Document the library that lies beside the book, whichever is installed."""
    sys.path.insert(0, str((ROOT / "nmpcrl").resolve().parent))
    app.connect("autodoc-process-signature", with_aliases)
    app.connect("doctree-resolved", with_aliases_of_fields)
    app.connect("doctree-read", with_tags)
    app.connect("html-page-context", accessible)
    app.connect("build-finished", with_landmarks)
    app.connect("autodoc-process-docstring", without_macros, priority=400)  # before napoleon's
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def with_aliases(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, given: str | None, returned: str
) -> tuple[str | None, str]:
    """A signature with `Array` for `Vector` and `Matrix`, and `...` for a default of no literal."""
    given = given and OBJECT.sub("...", given.replace(FLOATS, "Array"))
    return given, returned and returned.replace(FLOATS, "Array")


def with_aliases_of_fields(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """The type of a field, of which autodoc lets nobody change the signature."""
    for node in list(doctree.findall(addnodes.desc_annotation)):
        if SHORT in (words := node.astext()):
            node.children = [nodes.Text(words.replace(SHORT, "Array"))]


def without_macros(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """A docstring in which `|speed|` is no macro of reStructuredText, and departures are named."""
    lines[:] = [DEPARTURE.sub(r" (our assumption \1)", line.replace("|", r"\|")) for line in lines]


def with_tags(app: Sphinx, doctree: nodes.document) -> None:
    r"""Leave an equation that has a `\tag` to MathJax, which numbers it by that."""
    for node in doctree.findall(nodes.math_block):
        if r"\tag{" in (tex := node.astext()):
            node["nowrap"] = True
            node.children = [nodes.Text(rf"\[{tex}\]")]


def accessible(app: Sphinx, page: str, template: str, context: dict[str, Any], _: Any) -> None:
    """Give headers of tables a scope, each table a place in which it scrolls, and lists terms."""
    body = TABLE.sub(_scrolling, context.get("body", ""))
    context["body"] = PARAMETERS.sub(_without_a_list, body)


def with_landmarks(app: Sphinx, exception: Exception | None) -> None:
    """Make the side bar of every written page a landmark."""
    for path in Path(app.outdir).rglob("*.html"):
        named = f'{SIDEBAR} role="navigation" aria-label="Book"'
        path.write_text(path.read_text("utf-8").replace(SIDEBAR, named), "utf-8")


def _scrolling(table: re.Match[str]) -> str:
    head, end, body = table[0].rpartition("</thead>")
    scoped = _scoped(head, "col") + end + _scoped(body, "row")
    return f'<div class="scrolls" tabindex="0">{scoped}</div>'


def _without_a_list(signature: re.Match[str]) -> str:
    """A signature whose parameters are lines; Sphinx makes them a list without terms."""
    lines = signature[0].replace("<dl>", '<div class="parameters">').replace("</dl>", "</div>")
    return lines.replace("<dd>", '<div class="parameter">').replace("</dd>", "</div>")


def _scoped(part: str, scope: str) -> str:
    part = re.sub(r"<th\b[^>]*>\s*(<p>\s*</p>)?\s*</th>", "<td></td>", part)  # a header of nothing
    return re.sub(r"<th(?=[ >])(?![^>]*\bscope=)", f'<th scope="{scope}"', part)
