"""`nmpcrl wasm` writes a module, or says in one sentence why not."""

import pytest
from raising import raising

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


def test_a_problem_is_compiled_instead_of_a_plant_and_a_task(command, asked, tmp_path, monkeypatch):
    (tmp_path / "mine_for_wasm.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    assert command("wasm", "--problem", "mine_for_wasm:problem").exit_code == 0
    ((problem,),) = asked
    assert (problem.states, list(problem.names)) == (1, ["gain"])
    both = command("wasm", "--problem", "mine_for_wasm:problem", "--task", "mine_for_wasm:task")
    assert both.exit_code
    assert "a Problem has no Plant and no Task beside it" in both.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--plant", "robot"), "MODULE:NAME"),
        (("--plant", "nowhere_at_all:robot"), "No module named"),
        (("--plant", "nmpcrl.control:nothing"), "nothing"),
        (("--plant", "nmpcrl.study:paper"), "is no Plant"),
        (("--task", "nmpcrl.control:differential_drive"), "is no Task"),
        (("--problem", "nmpcrl.control:differential_drive"), "is no Problem"),
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
