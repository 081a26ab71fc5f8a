"""The beginning of a page: what was found, and then what a chapter needs before it can find it.

A notebook has to load before it can say anything, so what it found stands where it is known. On the
page the cells tagged `opening` come first, in a box, then those tagged `first-figure`, without
their code; and the code that sets a chapter up is one cell that is folded.
"""

import re
from typing import Any

from nbformat.v4 import new_markdown_cell

Cell = Any  # nbformat's, a dictionary with attributes

HEADING = re.compile(r"^#+ .*\n*", flags=re.M)
PROMPTS = {verb: f"{verb.title()} the parameters and the set-up" for verb in ("show", "hide")}


def opened(cells: list[Cell]) -> tuple[list[Cell], list[Cell]]:
    """The cells of a dressed page up to its set-up, and those from there on.

    What was not executed has nothing to say or to show, and stays.
    """
    found = [cell for cell in cells if "opening" in tags_of(cell) and cell.cell_type == "markdown"]
    title, *rest = [cell for cell in cells if cell not in found]
    figure = [cell for cell in rest if "first-figure" in tags_of(cell)]
    if all(map(_shows, figure)):
        rest = [cell for cell in rest if cell not in figure]
        figure = [_without_code(cell) for cell in figure]
    else:
        figure = []
    said = "\n\n".join(filter(None, (HEADING.sub("", cell.source).strip() for cell in found)))
    box = f"::::::{{admonition}} In short\n:class: note\n\n{said}\n::::::"
    boxed = [new_markdown_cell(box, id="opening")] if said else []
    return [title, *boxed, *figure], _set_up(rest)


def _shows(cell: Cell) -> bool:
    """Whether it is prose, or code that displays something."""
    return cell.cell_type == "markdown" or bool(cell.outputs)


def _without_code(cell: Cell) -> Cell:
    """The cell as a page shows it where its code would mean nothing yet."""
    if cell.cell_type == "code":
        kept = [tag for tag in tags_of(cell) if tag != "hide-input"]
        cell.metadata["tags"] = [*kept, "remove-input"]
    return cell


def _set_up(cells: list[Cell]) -> list[Cell]:
    """The cells, with one in the place of the code that shows nothing from the parameters on."""
    first = next((i for i, cell in enumerate(cells) if "parameters" in tags_of(cell)), None)
    if first is None:
        return cells
    last = next(i for i, cell in enumerate([*cells[first:], None], first) if not _silent(cell))
    one, *others = cells[first:last]
    one.source = "\n\n".join(cell.source for cell in (one, *others))
    one.metadata["tags"] = [*tags_of(one), "hide-input"]
    one.metadata["mystnb"] = {f"code_prompt_{name}": text for name, text in PROMPTS.items()}
    return [*cells[:first], one, *cells[last:]]


def _silent(cell: Cell) -> bool:
    """Whether it is code that displays nothing."""
    return cell is not None and cell.cell_type == "code" and not cell.outputs


def tags_of(cell: Cell) -> list[str]:
    """The tags of a cell, which may have none."""
    tags: list[str] = cell.metadata.get("tags", [])
    return tags
