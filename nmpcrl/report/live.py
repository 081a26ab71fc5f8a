"""Figures that a reader moves: the solver as WebAssembly, a problem, and the scripts that draw.

What a cell displays is whole: it works wherever a notebook's output runs scripts. `book/live.py`
puts the scripts into files that the pages share. Without scripts a page shows nothing of it, and a
notebook that is not trusted, which leaves `hidden` out, its sentence.
"""

import json
from base64 import b64encode
from typing import Any

import numpy as np
from IPython.display import HTML

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Task
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.control.ocp import transcribe
from nmpcrl.control.solvers.riccati import Riccati
from nmpcrl.learning import browser
from nmpcrl.report.prose import ROOT
from nmpcrl.study import paper

STYLE, SCRIPTS = "live.css", ("solver.js", "words.js", "plane.js", "controller.js")
ARGUMENTS = (
    "target", "lower", "upper", "discs", "sides", "discount", "slack_weight", "soft_box", "tie",
)  # fmt: skip
LONGEST = 20  # steps planned: a longer plan has several minima
WALL, AROUND = 0.5, 1.5  # of the map, beyond a wall and beyond an obstacle's circle [m]
FIGURE = """<figure class="live" data-figure="controller" hidden>
<p>This figure is live once the notebook is trusted, or its cells are run.</p>
<script type="application/json">{}</script>
</figure>"""
COMPILED = 'window.nmpcrl = { ...window.nmpcrl, module: "%s" };'
FILE = '<{kind} data-file="{name}">\n{text}\n</{kind}>'


def controller(nmpc: Nmpc, theta: Vector, steps: int) -> HTML:
    """The robot, its plan and its closed loop, whose start, obstacles, theta and N can be moved.

    Args:
        nmpc: the paper's robot and a task.
        theta: to begin with, shape (2n + m + 1,).
        steps: of the closed loop.
    """
    task = nmpc.task
    try:
        problem = problem_of(nmpc)
        module = browser.module(nmpc.plant, task)
    except CannotCompile as error:
        return HTML(f"<p>There is no live figure here: {error}.</p>")  # type: ignore[no-untyped-call]
    data = {
        "names": paper.THETA_NAMES,
        "ranges": ranges(theta),
        "steps": steps,
        "start": task.start.tolist(),
        "theta": theta.tolist(),
        "horizon": nmpc.horizon,
        "problem": problem | {"theta": len(theta)},
        "box": [task.lower[:2].tolist(), task.upper[:2].tolist()],
        "view": view(task),
        "radii": [one.diameter / 2 for one in task.obstacles],
        "robot": task.robot_diameter / 2,
    }
    shown = FIGURE.format(json.dumps(data)) + "\n" + "\n".join(files(module))
    return HTML(shown)  # type: ignore[no-untyped-call]


def problem_of(nmpc: Nmpc) -> dict[str, Any]:
    """What the module is given of a problem, under the names of `solvers.entries`; u_0 is free.

    Raises:
        CannotCompile: as `Riccati.prepare`.
    """
    options = {"fix_action": False, "ties_active": nmpc.ties_active}
    ocp = transcribe(nmpc.plant, nmpc.task, LONGEST, nmpc.gamma, nmpc.slack_weight, **options)
    solver = Riccati()
    values = zip(ARGUMENTS, solver.prepare(ocp).problem, strict=True)
    plain = {name: np.asarray(value).tolist() for name, value in values}
    return plain | {"tolerance": solver.tolerance}


def ranges(theta: Vector) -> dict[str, tuple[float, float, float]]:
    """Least, most and step of each slider; the initial theta is one of its steps."""
    *weights, c = theta.tolist()
    found = {
        name: (0.0, 4 * weight, weight / 20)
        for name, weight in zip(paper.THETA_NAMES, weights, strict=False)
    }
    found["c"] = (round(c - 0.2, 6), round(c + 0.5, 6), 0.01)
    return found | {"horizon": (1, LONGEST, 1)}


def view(task: Task) -> list[float]:
    """The part of the plane that the map shows: least x and y, width and height [m]."""
    x, y, clearance = task.discs
    centres, reach = np.column_stack([x, y]), clearance[:, None] / 2 + AROUND
    ends = np.array([task.start[:2], task.target[:2]])
    low = np.vstack([centres - reach, ends - AROUND]).min(axis=0)
    high = np.vstack([centres + reach, ends + AROUND]).max(axis=0)
    low = np.maximum(low, task.lower[:2] - WALL)
    high = np.minimum(high, task.upper[:2] + WALL)
    return [*low.tolist(), *(high - low).tolist()]


def files(module: bytes) -> list[str]:
    """Style, module and scripts in the order in which they are needed, each with its name."""
    folder = ROOT / "book/_static/live"
    texts = {name: (folder / name).read_text("utf-8") for name in (STYLE, *SCRIPTS)}
    texts = {STYLE: texts.pop(STYLE), "module.js": COMPILED % b64encode(module).decode()} | texts
    kinds = {name: "style" if name == STYLE else "script" for name in texts}
    return [FILE.format(kind=kinds[name], name=name, text=texts[name].strip()) for name in texts]
