"""A page for whoever does not see it or has no mouse: HTML in, HTML out, the last step of a build.

Sphinx, docutils, MyST-NB and pandas leave out what assistive technology goes by. The reading order,
the words and the look of a page stay as they are.

| as it was written | as it is left |
|---|---|
| `<th></th>`, a header of nothing | `<td></td>` |
| `<th>` | `<th scope="col">` in a table's head, `<th scope="row">` below it |
| `<table>` | in a `<div class="scrolls">`: to some readers what scrolls is no table |
| an admonition that a script folds | `<details>`, which keys and a search of the page open, too |
| a `<summary>` with a name other than its words | its words |
| a bibliography of deprecated roles | a list |
| a side bar outside every landmark | a landmark |
| exercises and solutions of one id | without that id |

`book/_static/scrolls.js` does the rest, which only a browser knows: what is too wide for its place.
"""

from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from bs4 import BeautifulSoup, Tag
from bs4.dammit import EntitySubstitution
from bs4.formatter import HTMLFormatter


def site(html: Path) -> None:
    """Repair every page below a folder, in place, two at a time and the largest first."""
    paths = [path for path in html.rglob("*.html") if "_static" not in path.parts]
    paths.sort(key=lambda path: path.stat().st_size, reverse=True)
    with ProcessPoolExecutor(max_workers=2, mp_context=get_context("spawn")) as pool:
        repaired = pool.map(page, [path.read_text("utf-8") for path in paths])
        for path, text in zip(paths, repaired, strict=True):
            path.write_text(text)


def page(html: str) -> str:
    """A whole page, repaired; one that is repaired already stays as it is."""
    soup = BeautifulSoup(html, "html.parser")
    for selector, repair in REPAIRS.items():
        for element in soup.select(selector):
            repair(element)
    html = soup.decode(formatter=InOrder(EntitySubstitution.substitute_xml))
    return html.replace(">\n\n", ">\n", 1)  # Beautiful Soup adds a line to the doctype


class InOrder(HTMLFormatter):
    """Attributes stay in the order in which they were written."""

    def attributes(self, tag: Tag) -> Iterable[tuple[str, str | None]]:
        return tag.attrs.items()  # type: ignore[return-value]


def _header(cell: Tag) -> None:
    if not cell.get_text(strip=True) and not cell.find("img"):
        cell.name = "td"
    else:
        cell["scope"] = "col" if cell.find_parent("thead") else "row"


def _wrapped(table: Tag) -> None:
    table.wrap(Tag(name="div", attrs={"class": "scrolls"}))


def _folded(box: Tag) -> None:
    """The title, a paragraph, becomes the summary that opens the box."""
    title = box.select_one(":scope > .admonition-title")
    assert title is not None
    title.name = "summary"
    box.name = "details"
    box["class"] = " ".join(name for name in box["class"] if name != "dropdown") + " folded"


def _named(name: str, kind: str) -> Callable[[Tag], None]:
    """Another element, of a class by which it is found again."""

    def repair(element: Tag) -> None:
        element.name = name
        element["class"] = kind

    return repair


def _without(*attributes: str) -> Callable[[Tag], None]:
    def repair(element: Tag) -> None:
        for name in attributes:
            del element[name]

    return repair


def _with(**attributes: str) -> Callable[[Tag], None]:
    return lambda element: element.attrs.update(attributes)


REPAIRS: dict[str, Callable[[Tag], None]] = {
    "article th": _header,
    "article table:not(.scrolls > table)": _wrapped,
    "article div.admonition.dropdown": _folded,
    "dt.sig dl": _named("div", "parameters"),  # a list without terms
    "dt.sig dd": _named("div", "parameter"),
    "summary[aria-label]": _without("aria-label"),
    ".citation[role]": _with(role="listitem"),
    "#pst-primary-sidebar": _with(**{"role": "navigation", "aria-label": "Book"}),
    "#exercise-content, #solution-content, #proof-content": _without("id"),
}
