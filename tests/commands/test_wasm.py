"""`nmpcrl wasm` writes a module and the numbers of its problem; nothing is compiled here."""

import json

import pytest

from nmpcrl.control.browser import packed
from nmpcrl.learning import browser

MINE = """
import numpy as np
from nmpcrl.control import Plant, Problem, Task

plant = Plant(lambda s, a: a, ("x [m]", "y [m]"), ("u", "v"), -np.ones(2), np.ones(2))
problem = Problem(states=1, inputs=1, horizon=3, theta={"gain": 1.0},
                  model=lambda x, u, th: x + th["gain"] * u, stage=lambda x, u, th: x**2 + u**2)

def task():
    return Task(np.zeros(2), np.ones(2), np.full(2, -9.0), np.full(2, 9.0), (), np.ones(2))
"""


@pytest.fixture(autouse=True)
def here(monkeypatch, tmp_path):
    (tmp_path / "mine_for_wasm.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("line", "sizes"),
    [
        ("", (3, 2, 4)),  # the paper's robot, by default
        ("--plant mine_for_wasm:plant --task mine_for_wasm:task", (2, 2, 0)),
        ("--problem mine_for_wasm:problem", (1, 1)),
    ],
)
def test_what_is_named_is_compiled(command, monkeypatch, tmp_path, line, sizes):
    asked = []
    monkeypatch.setattr(browser, "module", lambda *of: asked.append(of) or b"module")
    result = command("wasm", *line.split())
    assert result.exit_code == 0, result.output
    ((of, *task),) = asked
    assert (of.n if task else of.states, of.m if task else of.inputs) == sizes[:2]
    assert [len(one.obstacles) for one in task] == [*sizes[2:]]
    assert (tmp_path / "nmpc.wasm").read_bytes() == b"module"
    described = json.loads((tmp_path / "nmpc.json").read_text())
    assert (described["states"], described["inputs"]) == sizes[:2]
    assert described["numbers"] == packed(described).tolist()
