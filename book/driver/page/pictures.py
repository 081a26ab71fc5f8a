"""Figures on a page: files beside it, and the `<picture>` that chooses among them.

A figure of `nmpcrl.report.figures.sheet` displays a PNG, for every notebook editor. In a build it
displays more, for the page alone: its finding, an SVG of it, and one that a telephone has room for;
and a PDF, for whoever teaches.
"""

import re
from base64 import b64decode
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any

from nmpcrl.report.figures.moving import PLAY
from nmpcrl.report.figures.sheet import MIME

FOLDER = "_static/figures"
NARROW = "screen and (max-width: 720px)"  # where the letters of a wide figure are too small
IMAGE = re.compile(r"!\[(?P<alt>[^]]+)\]\(_static/(?P<name>\w+)\.svg\)")
PICTURE = """\
<a href="{wide}{plays}"><picture>
<source media="{media}" srcset="{narrow}" width="{narrow_width}" height="{narrow_height}">
<source srcset="{wide}">
<img src="{png}" alt="{alt}" width="{width}" height="{height}">
</picture></a>"""


def placed(notebook: Any) -> dict[str, bytes]:
    """Show each figure of an executed notebook as a picture; the files that it takes, by name.

    A figure without a narrow version, or whose notebook was not executed for a page, stays.
    """
    files: dict[str, bytes] = {}
    for cell, data in _figures(notebook):
        shown, settings = data.pop(MIME), cell.metadata["mystnb"]
        if "narrow" in shown:
            name = settings["figure"]["name"].removeprefix("fig-")
            wide, narrow = shown["wide"], shown["narrow"]
            png = _kept(files, name, {"png": data["image/png"]})
            data["text/html"] = PICTURE.format(
                png=png,
                wide=_kept(files, name, wide) or png,
                plays=f"#{PLAY}" if shown.get("plays") and "svg" in wide else "",
                narrow=_kept(files, f"{name}-narrow", narrow),
                media=NARROW,
                alt=escape(alternative(shown["finding"], settings["image"]["alt"])),
                width=wide["width"],
                height=wide["height"],
                narrow_width=narrow["width"],
                narrow_height=narrow["height"],
            )
    return files


def beside(markdown: str, folder: Path) -> str:
    """A page of Markdown in which an image shows its narrow version, if it has one, on telephones.

    Args:
        markdown: the page.
        folder: of the page; NAME.svg has NAME_narrow.svg beside it.
    """

    def shown(found: re.Match[str]) -> str:
        wide, narrow = (f"_static/{found['name']}{part}.svg" for part in ("", "_narrow"))
        if not (folder / narrow).exists():
            return found[0]
        (width, height), narrow_size = (_size(folder / path) for path in (wide, narrow))
        picture = PICTURE.format(
            png=f"../{wide}",
            wide=f"../{wide}",
            plays="",
            narrow=f"../{narrow}",
            media=NARROW,
            alt=escape(found["alt"]),
            width=width,
            height=height,
            narrow_width=narrow_size[0],
            narrow_height=narrow_size[1],
        )
        return f'<div class="cell_output docutils container">\n{picture}\n</div>'  # a block: whole

    return IMAGE.sub(shown, markdown)


def vectors(notebook: Any) -> dict[str, bytes]:
    """The figures of an executed notebook for one's own slides: SVG and PDF, by file name.

    Raises:
        KeyError: the notebook was executed before figures had a PDF.
    """
    files: dict[str, bytes] = {}
    for cell, data in _figures(notebook):
        shown = data[MIME]
        svg = shown["wide"].get("svg") or shown["wide"]["heavy"]
        files[f"{cell.id}.svg"] = svg.encode()
        files[f"{cell.id}.pdf"] = b64decode(shown["pdf"])
    return files


def plain(notebook: Any) -> Any:
    """A notebook without what only its page shows."""
    for _, data in _figures(notebook):
        del data[MIME]
    return notebook


def alternative(finding: str, form: str) -> str:
    """What a figure found, and then what it looks like."""
    end = "" if finding.endswith((".", "!", "?")) else "."
    return f"{finding}{end} {form}" if finding else form


def _figures(notebook: Any) -> Iterator[tuple[Any, Any]]:
    """The cells that display a figure for a page, and what they display."""
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            if MIME in output.get("data", {}):
                yield cell, output.data


def _size(svg: Path) -> tuple[int, int]:
    """Width and height of a picture in a browser's pixels, of which three are four points."""
    points = re.findall(r' (?:width|height)="([\d.]+)pt"', svg.read_text("utf-8"))[:2]
    width, height = (round(float(one) * 96 / 72) for one in points)
    return width, height


def _kept(files: dict[str, bytes], name: str, figure: dict[str, Any]) -> str:
    """Add a figure's file, an SVG if there is one; where a page finds it."""
    if "svg" in figure:
        files[f"{name}.svg"] = figure["svg"].encode()
        return f"../{FOLDER}/{name}.svg"
    if "png" in figure:
        files[f"{name}.png"] = b64decode(figure["png"])
        return f"../{FOLDER}/{name}.png"
    return ""
