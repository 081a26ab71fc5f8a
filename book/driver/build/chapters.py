"""What a chapter of the book is given and asked: its parameters, and what it needs."""

import difflib
from collections.abc import Callable, Iterable
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import nbformat
import papermill
import yaml

from driver.project import Failure, listed, notebooks

Given = dict[str, Any]  # parameters of a chapter by name


class Needs(NamedTuple):
    """What a chapter needs; its second cell gives names of these fields to what it needs."""

    experiments: tuple[Any, ...] = ()  # whole runs
    summaries: tuple[Any, ...] = ()  # of these runs
    beforehand: tuple[Callable[[], Any], ...] = ()  # done with the machine to itself


def together(needs: Iterable[Needs]) -> Needs:
    """What several chapters need, each thing once."""
    each = zip(*needs, strict=True)
    return Needs(*(tuple(dict.fromkeys(chain.from_iterable(one))) for one in each))


def parameters(notebook: Path) -> list[str]:
    """The names a notebook's cell tagged `parameters` declares."""
    return list(papermill.inspect_notebook(str(notebook)))


def known(chapter: str) -> Path:
    """The path of `chapter`, or a refusal that lists the chapters."""
    paths = notebooks()
    name = Path(chapter).stem
    if name not in paths:
        raise Failure(
            f"There is no chapter {chapter!r}{nearest(name, paths)}; "
            f"the chapters are {listed(paths)}."
        )
    return paths[name]


def refuse_unknown(notebook: Path, given: Given) -> None:
    """Papermill only logs a misspelt name; here it ends the build."""
    names = parameters(notebook)
    for name in given:
        if name not in names:
            raise Failure(
                f"{notebook.stem} has no parameter {name!r}{nearest(name, names)}; "
                f"its parameters are {listed(names)}."
            )


def ask(notebook: Path, given: Given) -> Needs:
    """What a chapter needs: run its parameters cell, set `given`, run its check cell."""
    refuse_unknown(notebook, given)
    cells = [cell for cell in nbformat.read(notebook, 4).cells if cell.cell_type == "code"]
    if not cells or "parameters" not in cells[0].metadata.get("tags", []):
        return Needs()
    names: dict[str, Any] = {"__name__": "__main__"}
    try:
        exec(cells[0].source, names)
        names.update(given)
        exec(cells[1].source, names)
    except ValueError as error:  # ParameterError: the chapter's own sentence
        raise Failure(str(error)) from error
    return Needs(*(tuple(names.get(need, ())) for need in Needs._fields))


def nearest(name: str, names: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, names, n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def values(
    pairs: Iterable[tuple[str, str]], raw: Iterable[tuple[str, str]], texts: Iterable[str]
) -> Given:
    """Parameters as papermill's own -p, -r and -y read them."""
    given: Given = {}
    for text in texts:
        try:
            given |= yaml.safe_load(text)
        except (yaml.YAMLError, TypeError) as error:
            raise Failure(f"-y takes a form such as '{{seeds: [3]}}', not {text!r}.") from error
    given |= {name: typed(value) for name, value in pairs}
    return given | dict(raw)


def typed(text: str) -> Any:
    """A value as `papermill -p` reads it: a truth, nothing, a number, or else a text."""
    words = {"True": True, "False": False, "None": None}
    if text in words:
        return words[text]
    for kind in (int, float):
        with suppress(ValueError):
            return kind(text)
    return text
