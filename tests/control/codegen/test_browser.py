"""The solver as a WebAssembly module gives the numbers of the machine code."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders import raising
from wasm_host import Controller, Module

from nmpcrl.control import Nmpc, Obstacle, differential_drive
from nmpcrl.control.codegen import browser
from nmpcrl.control.codegen.browser import from_texts
from nmpcrl.control.codegen.browser.link import FUNCTIONS, PAGES
from nmpcrl.control.solvers import stages
from nmpcrl.report.live.learning import LONGEST
from nmpcrl.study import paper
from nmpcrl.study.geometry import MOST_OBSTACLES

pytestmark = pytest.mark.slow

THETA = np.array(paper.THETA_INIT)
ROBOT = differential_drive()
TOLERANCE = 1e-8  # of solves that may end an iteration apart, as they are solved to
DEGENERATE = 13  # the seed of an optimum for which Python uses dense algebra
FREE = """import math
from numba import float64, njit
{}
EXPORTS = (f,)
"""
OF_X = """
@njit(float64(float64))
def {}(x):
    return {}
"""
STEP = """from numba import carray, float64, int32, njit, types
from .model import NU, NX, transition

address = types.CPointer(float64)

@njit(int32(address, address, address), error_model="numpy")
def step(state, action, out):
    x, u = carray(state, NX), carray(action, NU)
    transition(x, u, x, u, carray(out, NX))  # neither theta nor data are read
    return 0

EXPORTS = (step,)
"""


def of_x(body: str) -> dict[str, str]:
    """A package with one function f of a number."""
    return {"one": FREE.format(OF_X.format("f", body))}


def relative(found, expected) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def differs(found: dict, expected) -> float:
    """How much a solution's value or gradient is another, relative to its size."""
    return max(
        relative(found["value"], expected.value), relative(found["features"], expected.features)
    )


def drawn(seed: int) -> tuple[Nmpc, np.ndarray, np.ndarray, np.ndarray]:
    """A problem of any size, a state, theta and an action."""
    rng = np.random.default_rng(seed)
    obstacles = [Obstacle(*rng.uniform([-1, -1], [8, 4])) for _ in range(rng.integers(0, 9))]
    task = replace(paper.task("A"), obstacles=tuple(obstacles))
    nmpc = Nmpc(ROBOT, task, horizon=int(rng.choice([1, 2, 5, 10, 20, 40])))
    state = task.start + rng.uniform(-0.4, 4, 3) * [1, 0.5, 0.2]
    return nmpc, state, THETA * rng.uniform(0.3, 2.5, 9), rng.uniform(ROBOT.lower, ROBOT.upper)


def plans(there: Controller, nmpc: Nmpc, theta: np.ndarray, steps: int) -> Iterator[Any]:
    """Plans of both in the states of a rollout without noise; cost and next state are the same."""
    state, plan, theirs = nmpc.task.start, None, None
    for _ in range(steps):
        plan, theirs = nmpc.solve(state, theta, plan), there.solve(state, theta, theirs)
        yield theirs, plan
        cost = nmpc.task.stage_cost(state, plan.action)
        assert there.cost(state, plan.action) == pytest.approx(cost, rel=1e-12)
        later = nmpc.plant.step(state, plan.action)
        np.testing.assert_allclose(there.step(state, plan.action), later, rtol=1e-12, atol=1e-15)
        state = later


def test_a_rollout_without_noise_is_that_of_the_machine_code(robot_module):
    nmpc = paper.nmpc("A")
    for found, expected in plans(Controller(Module(robot_module), nmpc), nmpc, THETA, paper.STEPS):
        assert differs(found, expected) < 1e-11
        assert found["iterations"] == expected.iterations


@pytest.mark.parametrize("seed", range(20))
def test_values_gradients_and_products_are_those_of_the_machine_code(robot_module, seed):
    nmpc, state, theta, action = drawn(seed)
    there = Controller(Module(robot_module), nmpc)
    first, their_first = nmpc.solve(state, theta), there.solve(state, theta)
    assert differs(their_first, first) < 1e-9
    later = ROBOT.step(state, first.action)
    second = nmpc.solve(later, theta, first)
    their_second = there.solve(later, theta, their_first)
    assert differs(their_second, second) < TOLERANCE
    again = nmpc.solve(later, 1.01 * theta, second)
    assert differs(there.solve(later, 1.01 * theta, their_second), again) < TOLERANCE
    q = nmpc.solve(later, theta, second, action)
    their_q = there.solve(later, theta, their_second, action)
    assert differs(their_q, q) < TOLERANCE
    last = ROBOT.step(later, action)
    assert differs(there.solve(last, theta, their_q), nmpc.solve(last, theta, q)) < TOLERANCE
    product = there.slopes(later, theta, their_second, theta)
    if seed == DEGENERATE:
        assert product is None
    else:
        assert relative(product, nmpc.value_hessian_times(second, theta)) < 1e-4


def test_where_a_start_fails_the_next_one_is_tried_in_the_same_order(robot_module):
    """From a warm start that leads nowhere, the machine code and the module restart alike."""
    seen = set()
    for seed in range(40):
        nmpc, state, theta, _ = drawn(seed)
        first = nmpc.solve(state, theta)
        broken = replace(first, point=first.point * np.nan)
        later = state + np.random.default_rng(seed).normal(scale=0.1, size=3)
        expected = nmpc.solve(later, theta, broken)
        there = Controller(Module(robot_module), nmpc)
        found = there.solve(later, theta, {"fixed": 0, "numbers": broken.point})
        assert found["restarts"] == expected.restarts
        assert differs(found, expected) < 1e-9
        seen.add(expected.restarts)
    assert seen - {0}


def test_the_largest_layout_fits_and_a_host_that_reserves_too_much_is_told(robot_module):
    module = Module(robot_module)
    obstacles = tuple(Obstacle(0.4 * k, 6.0) for k in range(MOST_OBSTACLES))
    nmpc = Nmpc(ROBOT, replace(paper.task("A"), obstacles=obstacles), horizon=LONGEST)
    there = Controller(module, nmpc)
    start = nmpc.task.start
    expected = nmpc.solve(start, THETA)
    assert differs(there.solve(start, THETA), expected) < 1e-9
    end = PAGES * 65_536
    with pytest.raises(MemoryError):
        module("reserve", end)
    module("reserve", end - module("reserve", 8) - 1000)  # too little is left for the solver
    with pytest.raises(MemoryError):
        there.solve(start, THETA)


def test_a_module_is_made_once_with_the_same_bytes_and_again_after_damage(tmp_path, monkeypatch):
    """The plant's step alone goes through every stage, in seconds instead of a minute."""
    parts = {"model": stages.write(paper.nmpc("A").problem), "one": STEP}
    monkeypatch.setenv("NMPCRL_CACHE", str(tmp_path))
    first = from_texts(parts)
    with monkeypatch.context() as patch:
        patch.setattr(browser, "_build", raising(AssertionError("it is made")))
        assert from_texts(parts) == first
    (kept,) = tmp_path.glob("*.wasm.gz")
    kept.write_bytes(kept.read_bytes()[:-1] + b"?")
    assert from_texts(parts) == first


def test_every_function_that_a_host_gives_is_called_with_its_own_arguments():
    more = {"acosh": (1.3,), "atan2": (0.3, 2.5), "pow": (0.3, 2.5)}
    arguments = {name: more.get(name, (0.3,)) for name in sorted(FUNCTIONS)}
    called = {name: ", ".join(["x", *map(str, one[1:])]) for name, one in arguments.items()}
    functions = [OF_X.format(f"of_{name}", f"math.{name}({x})") for name, x in called.items()]
    exports = ", ".join(f"of_{name}" for name in arguments)
    text = FREE.format("".join(functions)).replace("(f,)", f"({exports})")
    module = Module(from_texts({"one": text}))
    for name, numbers in arguments.items():
        expected = getattr(math, name)(*numbers)
        assert module(f"of_{name}", numbers[0]) == pytest.approx(expected, rel=1e-15), name


@pytest.mark.parametrize(
    ("body", "reason"),
    [("math.erf(x)", "call erf, which a browser does not have"), ("nowhere(x)", "nowhere")],
)
def test_what_cannot_be_compiled_is_refused_by_name(body, reason):
    with pytest.raises(RuntimeError, match=reason):
        from_texts(of_x(body))
