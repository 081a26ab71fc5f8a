"""What cells displayed, as text: which of them are prose, and what a page of Markdown takes."""

import ast
import re
from collections.abc import Callable
from typing import Any

OUTPUT = re.compile(r"<!-- output: (?P<page>[\w.]+) (?P<tag>[\w-]+) -->")
PAGE = re.compile(r'href="([a-z_0-9]+)\.(?:ipynb|md)\b')  # of a link in HTML


def calls_prose(code: str) -> bool:
    """Whether a cell only shows paragraphs or source: what it imports does not count."""
    called = _called(code)
    return bool(called) and set(called) <= {"say", "source"}


def says(code: str) -> bool:
    """Whether a cell only shows prose and says a paragraph: editors hide its call, too."""
    return calls_prose(code) and "say" in _called(code)


def _called(code: str) -> list[str]:
    """What each statement of a cell calls and no more, without its imports."""
    nodes = ast.parse(code).body
    others = [node for node in nodes if not isinstance(node, ast.Import | ast.ImportFrom)]
    calls = [getattr(getattr(node, "value", None), "func", None) for node in others]
    return [getattr(call, "id", "") for call in calls]


def tags_of(cell: Any) -> list[str]:
    """The tags of a cell, which may have none."""
    return list(cell.metadata.get("tags", []))


def displayed(notebook: Any, tag: str) -> str:
    """What the cell with a tag displayed, HTML or Markdown; nothing if it was not executed."""
    (cell,) = (cell for cell in notebook.cells if tag in tags_of(cell))
    shown = [out.data for out in cell.outputs if "data" in out]
    return "\n\n".join(one.get("text/html") or one.get("text/markdown", "") for one in shown)


def filled(markdown: str, output: Callable[[str, str], str]) -> str:
    """Markdown in which `<!-- output: page.ipynb tag -->` is what `output` gives for these."""

    def shown(found: re.Match[str]) -> str:
        text = output(found["page"], found["tag"])
        if not text.startswith("<"):  # a paragraph
            return text
        linked = PAGE.sub(r'href="\1.html', text)
        return f'<div class="cell_output docutils container">\n{linked}\n</div>'

    return OUTPUT.sub(shown, markdown)
