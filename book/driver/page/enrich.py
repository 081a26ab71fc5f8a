"""The page's dress of a plain source: pages and cells in, pages and cells out.

Anchors, links, equations with `\\tag` and `<details>` pass as they are. What a page has besides:

| in the source | on the page |
|---|---|
| cells tagged `opening`, then those tagged `first-figure` | below the title |
| cells tagged `goals`, `try`, `exercise` or `algorithm` | a box |
| a cell tagged `caption` after a figure | its caption, with its label |
| cells that only call `say` or `source` | the paragraphs that they displayed |
| the parameters, and the code after them that shows nothing | one folded cell |
"""

import re
from itertools import pairwise, takewhile
from typing import Any

from nbformat.v4 import new_markdown_cell

from driver.page.prose import calls_prose, tags_of

Cell = Any  # nbformat's, a dictionary with attributes

ANCHOR = r'<a id="(?P<label>[^"]+)"></a>\n'
BLOCK = re.compile(rf"^( *){ANCHOR}(?= *\$\$$|#+ )", flags=re.M)  # before an equation or a heading
BOXES = {"goals", "try", "exercise", "algorithm"}
PROMPTS = {f"code_prompt_{verb}": f"{verb.title()} the set-up" for verb in ("show", "hide")}


def text(markdown: str) -> str:
    """Markdown in which an anchor before an equation or a heading is a paragraph of its own."""
    return BLOCK.sub(r'\1<a id="\g<label>"></a>\n\n', markdown)


def notebook(source: Any, download: str = "") -> Any:
    """A notebook, executed or not, for the page, with a link to its file below the title."""
    title, *rest = _captioned([_dressed(cell) for cell in source.cells])
    said = [cell for cell in rest if "opening" in tags_of(cell) and cell.cell_type == "markdown"]
    first = [cell for cell in rest if "first-figure" in tags_of(cell) and _shows(cell)]
    for cell in first:
        cell.metadata["tags"] = [{"hide-input": "remove-input"}.get(t, t) for t in tags_of(cell)]
    words = "\n\n".join(re.sub(r"^#+ .*\n*", "", cell.source, flags=re.M) for cell in said)
    link = f'<p class="download"><a href="{download}" download>This page as a notebook</a></p>'
    top = [box(link)] * bool(download) + [box(f"**In short.**\n\n{words}", "opening")] * bool(said)
    source.cells = [title, *top, *first, *_set_up([c for c in rest if c not in said + first])]
    return source


def box(markdown: str, kind: str = "") -> Cell:
    """A cell of Markdown, in a `<div>` of its kind if it has one."""
    return new_markdown_cell(f'<div class="{kind}">\n\n{markdown}\n\n</div>' if kind else markdown)


def _dressed(cell: Cell) -> Cell:
    """A cell as Markdown where it is prose, in its box."""
    if cell.cell_type == "code":
        if not (cell.outputs and calls_prose(cell.source)):
            return cell
        shown = (out.data["text/markdown"] for out in cell.outputs if "data" in out)
        about = {"tags": tags_of(cell)}
        return new_markdown_cell(text("\n\n".join(shown)), id=cell.id, metadata=about)
    (kind,) = BOXES.intersection(tags_of(cell)) or ("",)
    cell.source = box(text(cell.source), kind).source
    return cell


def _captioned(cells: list[Cell]) -> list[Cell]:
    """The cells without captions, which become the name and the caption of the figure before."""
    for figure, cell in pairwise(cells):
        if "caption" in tags_of(cell) and (label := re.match(ANCHOR, cell.source)):
            shown = {"name": label["label"], "caption": cell.source[label.end() :]}
            figure.metadata.setdefault("mystnb", {})["figure"] = shown
    return [cell for cell in cells if "caption" not in tags_of(cell)]


def _shows(cell: Cell) -> bool:
    """Whether it is prose, or code that displays something."""
    return cell.cell_type == "markdown" or bool(cell.outputs)


def _set_up(cells: list[Cell]) -> list[Cell]:
    """The cells, with one in the place of the code that shows nothing from the parameters on."""
    first = next((i for i, cell in enumerate(cells) if "parameters" in tags_of(cell)), len(cells))
    code = [*takewhile(lambda cell: not _shows(cell), cells[first:])]
    for cell in code[:1]:
        cell.source = "\n\n".join(one.source for one in code)
        cell.metadata |= {"tags": [*tags_of(cell), "hide-input"], "mystnb": PROMPTS}
    return [*cells[:first], *code[:1], *cells[first + len(code) :]]
