"""The page's dress of what stands plainly in a source: pages and cells in, pages and cells out.

A source of this book reads well in any notebook editor, so it has nothing that only the page knows.
What the page needs stands where an editor shows nothing, or as what an editor shows anyway:

| in the source | on the page |
|---|---|
| `<a id="eq-x"></a>` before `$$ ... \\tag{1.2} $$` | a numbered equation with that label |
| `<a id="x"></a>` before a heading | a label |
| `[Eq. (1.2)](page.ipynb#eq-x)`, `[Fig. 1.2](#fig-x)`, `[departure A](departures.ipynb#departure-A)` | references, which Sphinx numbers and checks |
| `[Gros (2020)](references.md#key)`, `[(Gros, 2020)](references.md#key)` | citations, as a word and in brackets |
| `<details><summary>title</summary>` | a box that opens |
| a list of `<a id="key"></a>` on the page of references | the bibliography |
| `<!-- output: page.ipynb tag -->` | what the cell with that tag displayed |
| cells tagged `opening` | a box below the title |
| cells tagged `first-figure` | below that box, without their code |
| cells tagged `goals`, `try`, `exercise`, `solution`, `algorithm` | boxes |
| a cell tagged `caption` after a figure | its caption, with number and label |
| cells that only call `say` or `source` | the paragraphs that they displayed |
"""  # noqa: E501

import ast
import re
from collections.abc import Callable, Iterator
from typing import Any

import nbformat

from driver.page.opening import Cell, opened, tags_of
from nmpcrl.control.solvers.riccati import NOTICE

ANCHOR = r'<a id="(?P<label>[^"]+)"></a>\n'
EQUATION = re.compile(
    rf"^(?P<indent> *){ANCHOR} *\$\$\n(?P<body>(?:(?!\$\$).)*?)\n *\\tag\{{[^}}]*\}}\n *\$\$$",
    flags=re.M | re.S,
)
HEADING = re.compile(rf"^{ANCHOR}(?=#+ )", flags=re.M)
LINK = re.compile(r"\[(?P<words>[^][]+)\]\((?P<page>[\w.-]*)#(?P<label>[\w:-]+)\)")
NUMBER = re.compile(rf"{ANCHOR}\*\*(?:Exercise|Algorithm|Fig\.) [\d.]+\*\* ?")
DETAILS = re.compile(
    r"<details><summary>(?P<title>.*?)</summary>\n\n(?P<body>.*?)\n\n</details>", flags=re.S
)
ENTRIES = re.compile(r'(?:^- <a id="[^"]+"></a>.*\n(?:  .*\n)*)+', flags=re.M)
OUTPUT = re.compile(r"<!-- output: (?P<page>[\w.]+) (?P<tag>[\w-]+) -->")
PROSE = ("say", "source")
COMPILED = re.compile(re.escape(NOTICE) + r" done in \d+ s\.\n")
PAGE = re.compile(r'href="([a-z_0-9]+)\.(?:ipynb|md)\b')  # of a link in HTML
DOWNLOAD = '<p class="download"><a href="{}" download>Download this page as a notebook</a></p>'


def text(markdown: str) -> str:
    """Markdown with its labels, references, equations and folded parts as MyST has them."""
    markdown = EQUATION.sub(_equation, markdown)
    markdown = HEADING.sub(r"(\g<label>)=\n", markdown)
    markdown = DETAILS.sub(_folded, markdown)
    return LINK.sub(_reference, markdown)


def page(markdown: str, outputs: Callable[[str, str], str]) -> str:
    """A page of Markdown; `outputs` gives what a notebook's cell with a tag displayed."""

    def shown(found: re.Match[str]) -> str:
        output = outputs(found["page"], found["tag"])
        if not output.startswith("<"):  # a paragraph
            return output
        linked = PAGE.sub(r'href="\1.html', output)
        return f'<div class="cell_output docutils container">\n{linked}\n</div>'

    return text(OUTPUT.sub(shown, ENTRIES.sub("```{bibliography}\n```\n", markdown)))


def notebook(source: Any, download: str = "") -> Any:
    """A notebook, executed or not, for the page, with a link to its file below the title."""
    first, rest = opened(list(_captioned(_dressed(source.cells))))
    if download:
        first.append(nbformat.v4.new_markdown_cell(DOWNLOAD.format(download)))
    source.cells = [*first, *rest]
    for cell in source.cells:
        for output in cell.get("outputs", []):
            if "text/markdown" in output.get("data", {}):
                output.data["text/markdown"] = text(output.data["text/markdown"])
    return source


def without_notices(executed: Any) -> Any:
    """An executed notebook without what the first solve of a plant says on a new machine.

    Everything else on standard error stays, and ends the build.
    """
    for cell in executed.cells:
        outputs = cell.get("outputs", [])
        said = [one for one in outputs if one.get("name") == "stderr"]
        text = "".join(one.text for one in said)
        left = COMPILED.sub("", text)
        if left != text:
            others = [one for one in outputs if one not in said]
            kept = [nbformat.v4.new_output("stream", name="stderr", text=left)] if left else []
            cell.outputs = [*kept, *others]
    return executed


def download(executed: Any) -> Any:
    """An executed notebook for whoever opens it: prose without the calls that made it."""
    executed.metadata.pop("papermill", None)
    for cell in executed.cells:
        cell.metadata.pop("papermill", None)
        if cell.cell_type == "code" and calls_prose(cell.source):
            cell.metadata["jupyter"] = {"source_hidden": True}
    return executed


def output(source: Any, tag: str) -> str:
    """What the cell with a tag displayed, HTML or Markdown; nothing if it was not executed."""
    (cell,) = (cell for cell in source.cells if tag in tags_of(cell))
    shown = [one.data for one in cell.outputs if "data" in one]
    return "\n\n".join(one.get("text/html") or one.get("text/markdown", "") for one in shown)


def calls_prose(code: str) -> bool:
    """Whether a cell only shows paragraphs or source: what it imports does not count."""
    called = _called(code)
    return bool(called) and set(called) <= set(PROSE)


def says(code: str) -> bool:
    """Whether a cell only shows prose and says a paragraph: editors hide its call, too."""
    return calls_prose(code) and "say" in _called(code)


def _called(code: str) -> list[str]:
    """What each statement of a cell calls and no more, without its imports."""
    nodes = ast.parse(code).body
    return [_calls(node) for node in nodes if not isinstance(node, ast.Import | ast.ImportFrom)]


def _calls(node: ast.stmt) -> str:
    """The name of the function that a statement calls, and does nothing else."""
    call = node.value if isinstance(node, ast.Expr) else None
    named = isinstance(call, ast.Call) and isinstance(call.func, ast.Name)
    return call.func.id if named else ""  # type: ignore[union-attr]


def _dressed(cells: list[Cell]) -> Iterator[Cell]:
    """The cells as Markdown with MyST's boxes; a solution is the one of the exercise before it."""
    exercise = ""
    for cell in cells:
        if cell.cell_type == "code":
            yield _paragraphs(cell) if cell.outputs and calls_prose(cell.source) else cell
            continue
        label = re.match(ANCHOR, cell.source)
        if "exercise" in tags_of(cell) and label:
            exercise = label["label"]
        box = next((BOXES[tag] for tag in tags_of(cell) if tag in BOXES), None)
        cell.source = text(box(cell.source, exercise) if box else cell.source)
        yield cell


def _paragraphs(cell: Cell) -> Cell:
    """What a cell displayed, as a Markdown cell."""
    shown = (one.data["text/markdown"] for one in cell.outputs if "data" in one)
    whole, about = "\n\n".join(map(text, shown)), {"tags": tags_of(cell)}
    return nbformat.v4.new_markdown_cell(whole, id=cell.id, metadata=about)


def _captioned(cells: Iterator[Cell]) -> Iterator[Cell]:
    """The cells without captions, which become the name and the caption of the figure before."""
    figure: Cell = None
    for cell in cells:
        if "caption" in tags_of(cell):
            label = re.match(ANCHOR, cell.source)
            assert figure is not None
            assert label
            shown = {"name": label["label"], "caption": NUMBER.sub("", cell.source)}
            figure.metadata.setdefault("mystnb", {})["figure"] = shown
            continue
        if figure is not None:
            yield figure
        figure = cell
    if figure is not None:
        yield figure


def _equation(found: re.Match[str]) -> str:
    lines = ["```{math}", f":label: {found['label']}", *found["body"].splitlines(), "```"]
    return "\n".join(found["indent"] + line.removeprefix(found["indent"]) for line in lines)


def _folded(found: re.Match[str]) -> str:
    title = re.sub(r"</?code>", "`", found["title"])
    return _box(f"{{admonition}} {title}\n:class: dropdown", found["body"])


def _reference(found: re.Match[str]) -> str:
    """A link to a label as a role: numbers are Sphinx's own, words are kept."""
    words, label = found["words"], found["label"]
    if found["page"] == "references.md":
        return f"{{cite:{'p' if words.startswith('(') else 't'}}}`{label}`"
    kind = label.partition("-")[0]
    if kind in NUMBERED:
        return f"{{{NUMBERED[kind]}}}`{label}`"
    return f"{{ref}}`{label}`" if label.startswith("ex-") else f"{{ref}}`{words} <{label}>`"


NUMBERED = {"eq": "eq", "fig": "numref", "alg": "prf:ref"}


def _goals(source: str, _: str) -> str:
    return _box(
        "{admonition} Learning goals\n:class: tip dropdown",
        source.removeprefix("**Learning goals.** "),
    )


def _try(source: str, _: str) -> str:
    return _box("{admonition} Try\n:class: seealso", source.removeprefix("**Try.** "))


def _exercise(source: str, label: str) -> str:
    return _box(f"{{exercise}}\n:label: {label}", NUMBER.sub("", source))


def _solution(source: str, label: str) -> str:
    found = DETAILS.fullmatch(source)
    assert found
    return _box(f"{{solution}} {label}\n:class: dropdown", found["body"])


def _algorithm(source: str, _: str) -> str:
    label = re.match(ANCHOR, source)
    assert label
    title, _, body = NUMBER.sub("", source).partition("\n\n")
    return _box(f"{{prf:algorithm}} {title.strip('*')}\n:label: {label['label']}", body)


BOXES = {
    "goals": _goals,
    "try": _try,
    "exercise": _exercise,
    "solution": _solution,
    "algorithm": _algorithm,
}


def _box(head: str, body: str) -> str:
    return f"::::::{head}\n\n{body}\n::::::"
