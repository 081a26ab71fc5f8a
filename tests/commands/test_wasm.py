"""`nmpcrl wasm` writes a module, or says in one sentence why not."""

import json

import pytest
from raising import raising

from nmpcrl.control.browser import packed
from nmpcrl.learning import browser

MINE = """
import numpy as np
from nmpcrl.control import Plant, Problem, Task

plant = Plant(lambda s, a: a, ("x [m]", "y [m]"), ("u", "v"), -np.ones(2), np.ones(2))

problem = Problem(
    states=1,
    inputs=1,
    horizon=3,
    theta={"gain": 1.0},
    model=lambda x, u, th: x + th["gain"] * u,
    stage=lambda x, u, th: x**2 + u**2,
)

def task():
    return Task(np.zeros(2), np.ones(2), np.full(2, -9.0), np.full(2, 9.0), (), np.ones(2))
"""


@pytest.fixture
def asked(monkeypatch, tmp_path):
    """What was asked to be compiled; nothing is. A module lies in the working directory."""
    calls = []
    monkeypatch.setattr(browser, "module", lambda *of: calls.append(of) or b"module")
    (tmp_path / "mine_for_wasm.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    return calls


@pytest.mark.parametrize(
    ("line", "sizes"),
    [
        ("", (3, 2, 4)),  # the paper's robot, by default
        ("--plant mine_for_wasm:plant --task mine_for_wasm:task", (2, 2, 0)),
        ("--problem mine_for_wasm:problem", (1, 1)),
    ],
)
def test_what_is_named_is_compiled(command, asked, tmp_path, line, sizes):
    result = command("wasm", *line.split())
    assert result.exit_code == 0, result.output
    ((of, *task),) = asked
    assert (of.n if task else of.states, of.m if task else of.inputs) == sizes[:2]
    assert [len(one.obstacles) for one in task] == [*sizes[2:]]
    assert (tmp_path / "nmpc.wasm").read_bytes() == b"module"
    described = json.loads((tmp_path / "nmpc.json").read_text())
    assert (described["states"], described["inputs"]) == sizes[:2]
    assert described["numbers"] == packed(described).tolist()
    assert "nmpc.wasm: 0 kB" in result.output


def test_a_plant_of_other_states_than_the_papers_task_is_refused(command, asked):
    said = command("wasm", "--plant", "mine_for_wasm:plant")
    assert "the task has 3 states, the plant 2" in said.stderr
    assert not asked


def test_what_the_compiler_says_is_said(command, monkeypatch, tmp_path):
    error = RuntimeError("numba cannot compile these functions")
    monkeypatch.setattr(browser, "module", raising(error))
    result = command("wasm", "--out", str(tmp_path / "x.wasm"))
    assert result.exit_code == 1
    assert "numba cannot compile" in result.output
    assert not (tmp_path / "x.wasm").exists()
