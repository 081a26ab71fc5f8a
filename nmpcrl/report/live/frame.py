"""The frame of every live figure: what it is given, its style, its module and its scripts."""

import gzip
import json
import os
from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from IPython.display import HTML

from nmpcrl.control import Nmpc
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.learning import browser
from nmpcrl.report.prose import ROOT

STYLE, MODULE = "live.css", "module.js"
PARTS = ("solver.js", "words.js", "plane.js", "parts.js")  # of every figure that solves
FIGURE = """<figure class="live" data-figure="{}" hidden>
<p>This figure is live once the notebook is trusted, or its cells are run.</p>
<script type="application/json">{}</script>
</figure>"""
COMPILED = 'window.nmpcrl = { ...window.nmpcrl, module: "%s" };'
FILE = '<{kind} data-file="{name}">\n{text}\n</{kind}>'


def figure(
    name: str,
    data: Mapping[str, Any],
    scripts: Iterable[str],
    module: bytes | None = None,
    styles: Iterable[str] = (),
) -> HTML:
    """A live figure; a sentence where its scripts are not to be had.

    Args:
        name: by which its script finds it.
        data: what its script is given.
        scripts: of the folder of live figures, in the order in which they are needed.
        module: WebAssembly, if it solves; `nmpcrl.module` of a page is this.
        styles: besides that of every live figure.
    """
    if not folder().is_dir():
        return absent(f"its scripts are not in {folder()}, and NMPCRL_LIVE may say where they are")
    shown = [FIGURE.format(name, json.dumps(data)), *files(scripts, module, styles)]
    return HTML("\n".join(shown))  # type: ignore[no-untyped-call]


def solving(name: str, nmpc: Nmpc, data: Callable[[], Mapping[str, Any]], *more: str) -> HTML:
    """A live figure that solves; a sentence where its controller cannot be compiled.

    Args:
        name: of the figure, and of its script without .js.
        nmpc: whose plant and task are compiled.
        data: makes what the script is given.
        more: scripts between `PARTS` and the figure's own.
    """
    try:
        return figure(name, data(), scripts_of(name, *more), browser.module(nmpc.plant, nmpc.task))
    except CannotCompile as error:
        return absent(error)


def scripts_of(name: str, *more: str) -> tuple[str, ...]:
    """The scripts of a figure that solves, in the order in which they are needed."""
    return (*PARTS, *more, f"{name}.js")


def folder() -> Path:
    """Where the scripts are, or what the environment variable NMPCRL_LIVE says."""
    return Path(os.environ.get("NMPCRL_LIVE") or ROOT / "book/_static/live")


def absent(why: object) -> HTML:
    """What stands in the place of a figure."""
    return HTML(f"<p>There is no live figure here: {why}.</p>")  # type: ignore[no-untyped-call]


def files(scripts: Iterable[str], module: bytes | None, styles: Iterable[str] = ()) -> list[str]:
    """Styles, module and scripts in the order in which they are needed, each with its name."""
    texts = {name: (folder() / name).read_text("utf-8") for name in (STYLE, *styles)}
    if module is not None:
        texts[MODULE] = COMPILED % b64encode(gzip.compress(module, mtime=0)).decode()
    texts |= {name: (folder() / name).read_text("utf-8") for name in scripts}
    kinds = {name: "style" if name.endswith(".css") else "script" for name in texts}
    return [FILE.format(kind=kinds[name], name=name, text=texts[name].strip()) for name in texts]
