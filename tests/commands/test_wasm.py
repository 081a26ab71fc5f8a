"""`nmpcrl wasm` writes a module, or says in one sentence why not."""

import pytest
from raising import raising

from nmpcrl.learning import browser

MINE = """
import numpy as np
from nmpcrl.control import Plant, Task

plant = Plant(lambda s, a: a, ("x [m]", "y [m]"), ("u", "v"), -np.ones(2), np.ones(2))

def task():
    return Task(np.zeros(2), np.ones(2), np.full(2, -9.0), np.full(2, 9.0), (), np.ones(2))
"""


@pytest.fixture
def asked(monkeypatch):
    """What was asked to be compiled; nothing is."""
    calls = []
    monkeypatch.setattr(browser, "module", lambda *of: calls.append(of) or b"module")
    return calls


def test_the_papers_robot_is_compiled_by_default(command, asked, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = command("wasm")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "nmpc.wasm").read_bytes() == b"module"
    ((plant, task),) = asked
    assert (plant.n, plant.m, len(task.obstacles)) == (3, 2, 4)
    assert "nmpc.wasm: 0 kB" in result.output


def test_a_plant_in_a_file_beside_is_found(command, asked, tmp_path, monkeypatch):
    (tmp_path / "mine_for_wasm.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    named = ("--plant", "mine_for_wasm:plant", "--task", "mine_for_wasm:task")
    assert command("wasm", *named).exit_code == 0
    ((plant, task),) = asked
    assert (plant.n, task.obstacles) == (2, ())
    assert "states" in command("wasm", *named[:2]).output  # the paper's task has three


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--plant", "robot"), "MODULE:NAME"),
        (("--plant", "nowhere_at_all:robot"), "No module named"),
        (("--plant", "nmpcrl.control:nothing"), "nothing"),
        (("--plant", "nmpcrl.study:paper"), "is no Plant"),
        (("--task", "nmpcrl.control:differential_drive"), "is no Task"),
        (("--out", "/nowhere/at/all.wasm"), "cannot be written"),
    ],
)
def test_what_cannot_be_compiled_ends_in_a_sentence(command, asked, arguments, said):
    result = command("wasm", *arguments)
    assert result.exit_code
    assert said in result.output
    assert "Traceback" not in result.output
    assert not asked


def test_what_the_compiler_says_is_said(command, monkeypatch, tmp_path):
    monkeypatch.setattr(
        browser, "module", raising(RuntimeError("numba cannot compile these functions"))
    )
    result = command("wasm", "--out", str(tmp_path / "x.wasm"))
    assert result.exit_code == 1
    assert "numba cannot compile" in result.output
    assert not (tmp_path / "x.wasm").exists()
