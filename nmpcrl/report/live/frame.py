"""The frame of every live figure: what it is given, its style, its module and its scripts."""

import gzip
import json
import os
from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from IPython.display import HTML

from nmpcrl.control import Nmpc, Problem
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.learning import browser
from nmpcrl.report.prose import ROOT

STYLE, MODULE, PROBLEM = "live.css", "module.js", "problem_module.js"
PARTS = ("solver.js", "words.js", "parts.js")  # of every figure that solves
MAP = ("plane.js", "map_parts.js")
FIGURE = """<figure class="live" data-figure="{}" hidden>
<p>This figure is live once the notebook is trusted, or its cells are run.</p>
<script type="application/json">{}</script>
</figure>"""
COMPILED = 'window.nmpcrl = { ...window.nmpcrl, %s: "%s" };'
FILE = '<{kind} data-file="{name}">\n{text}\n</{kind}>'


def figure(
    name: str,
    data: Mapping[str, Any],
    scripts: Iterable[str],
    modules: Mapping[str, bytes],
    styles: Iterable[str] = (),
) -> HTML:
    """A live figure; a sentence where its scripts are not to be had.

    Args:
        name: by which its script finds it.
        data: what its script is given.
        scripts: of the folder of live figures, in the order in which they are needed.
        modules: WebAssembly by the file's name; `nmpcrl.module` of a page is that of module.js.
        styles: besides that of every live figure.
    """
    if not folder().is_dir():
        return absent(f"its scripts are not in {folder()}, and NMPCRL_LIVE may say where they are")
    shown = [FIGURE.format(name, json.dumps(data)), *files(scripts, modules, styles)]
    return HTML("\n".join(shown))  # type: ignore[no-untyped-call]


def solving(
    name: str,
    nmpc: Nmpc,
    data: Callable[[], Mapping[str, Any]],
    scripts: Iterable[str],
    styles: Iterable[str] = (),
    problem: Problem | None = None,
) -> HTML:
    """A live figure that solves; a sentence where its controller cannot be compiled.

    Args:
        name: as for `figure`, and so are scripts and styles.
        nmpc: whose plant and task are compiled.
        data: makes what the script is given.
        problem: what it solves besides, as `nmpcrl.problem_module`.
    """
    try:
        modules = {MODULE: browser.module(nmpc.plant, nmpc.task)}
        if problem is not None:
            modules[PROBLEM] = browser.module(problem)
        return figure(name, data(), scripts, modules, styles)
    except CannotCompile as error:
        return absent(error)


def scripts_of(name: str, *more: str) -> tuple[str, ...]:
    """The scripts of a figure that solves, in the order in which they are needed.

    Args:
        name: of its own script without .js, and of its words without _words.js.
        more: what its own script needs besides `PARTS` and its words.
    """
    return (*PARTS, f"{name}_words.js", *more, f"{name}.js")


def folder() -> Path:
    """Where the scripts are, or what the environment variable NMPCRL_LIVE says."""
    return Path(os.environ.get("NMPCRL_LIVE") or ROOT / "book/_static/live")


def absent(why: object) -> HTML:
    """What stands in the place of a figure."""
    return HTML(f"<p>There is no live figure here: {why}.</p>")  # type: ignore[no-untyped-call]


def files(
    scripts: Iterable[str], modules: Mapping[str, bytes], styles: Iterable[str] = ()
) -> list[str]:
    """Styles, modules and scripts in the order in which they are needed, each with its name."""
    texts = {name: (folder() / name).read_text("utf-8") for name in (STYLE, *styles)}
    for name, module in modules.items():
        packed = b64encode(gzip.compress(module, mtime=0)).decode()
        texts[name] = COMPILED % (name.removesuffix(".js"), packed)
    texts |= {name: (folder() / name).read_text("utf-8") for name in scripts}
    kinds = {name: "style" if name.endswith(".css") else "script" for name in texts}
    return [FILE.format(kind=kinds[name], name=name, text=texts[name].strip()) for name in texts]
