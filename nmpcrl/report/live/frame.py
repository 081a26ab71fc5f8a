"""The frame of every live figure: what it is given, its style, its module and its scripts."""

import gzip
import json
import os
from base64 import b64encode
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from IPython.display import HTML

from nmpcrl.control import Nmpc, Problem
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.learning import browser
from nmpcrl.report.prose import ROOT

STYLE, MODULE, PROBLEM = "live.css", "module.js", "problem_module.js"
SHARED = ("solver.js", "parts.js", "controls.js", "map.js", "chart.js")  # in this order
FIGURE = """<figure class="live" data-figure="{}" hidden>
<p>This figure is live once the notebook is trusted, or its cells are run.</p>
<script type="application/json">{}</script>
</figure>"""
COMPILED = 'window.nmpcrl = {{ ...window.nmpcrl, {}: "{}" }};'
FILE = '<{kind} data-file="{name}">\n{text}\n</{kind}>'


def solving(
    name: str,
    nmpc: Nmpc,
    data: Mapping[str, Any],
    *scripts: str,
    problem: Problem | None = None,
) -> HTML:
    """A live figure; a sentence where it cannot be compiled, or its scripts are not to be had.

    Args:
        name: of its script without .js.
        nmpc: whose plant and task are compiled, as `nmpcrl.module` of the page.
        data: what the script is given.
        scripts: that its own needs besides `SHARED`.
        problem: what it solves besides, as `nmpcrl.problem_module`.
    """
    here = Path(os.environ.get("NMPCRL_LIVE") or ROOT / "book/_static/live")
    if not here.is_dir():
        return _absent(f"its scripts are not in {here}, and NMPCRL_LIVE may say where they are")
    try:
        modules = {MODULE: browser.module(nmpc.plant, nmpc.task)}
        if problem is not None:
            modules[PROBLEM] = browser.module(problem)
    except CannotCompile as error:
        return _absent(error)
    texts = {STYLE: (here / STYLE).read_text("utf-8")}
    for file, module in modules.items():
        packed = b64encode(gzip.compress(module, mtime=0)).decode()
        texts[file] = COMPILED.format(file.removesuffix(".js"), packed)
    for file in (*SHARED, *scripts, f"{name}.js"):
        texts[file] = (here / file).read_text("utf-8")
    kinds = {file: "style" if file == STYLE else "script" for file in texts}
    files = [FILE.format(kind=kinds[one], name=one, text=texts[one].strip()) for one in texts]
    return HTML("\n".join([FIGURE.format(name, json.dumps(data)), *files]))  # type: ignore[no-untyped-call]


def _absent(why: object) -> HTML:
    return HTML(f"<p>There is no live figure here: {why}.</p>")  # type: ignore[no-untyped-call]
