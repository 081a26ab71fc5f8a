"""The network's machine code: mini-batches are drawn fairly, and WebAssembly computes the same."""

from typing import Any

import numpy as np
import pytest
from wasm_host import Module

from nmpcrl.control.codegen.browser import from_texts
from nmpcrl.learning.network import TEXT, QNetwork, machine_code

ARRAYS = "weights, examples, order, counts, draw, scales, rate, sizes, inputs, capacity"
ENTRIES = f"""
import numpy as np
from numba import carray, float32, float64, int32, int64, njit, types, uint64

from .dense import at_addresses, fit, predict, remember

singles, numbers, integers, counts, states = map(
    types.CPointer, (float32, float64, int32, int64, uint64)
)
NET = (singles, singles, integers, counts, states, numbers, float64, counts, int32, int32)


@njit(int32(*NET, numbers, float64))
def network_remember({ARRAYS}, row, target):
    remember(at_addresses({ARRAYS}), carray(row, inputs), target)
    return 0


@njit(float64(*NET))
def network_fit({ARRAYS}):
    return fit(at_addresses({ARRAYS}))


@njit(float64(*NET, numbers))
def network_predict({ARRAYS}, row):
    value = np.empty(1)
    predict(at_addresses({ARRAYS}), carray(row, (1, inputs)), value)
    return value[0]


EXPORTS = (network_remember, network_fit, network_predict)
"""
EXAMPLES, INPUTS = 300, 14


@pytest.fixture(scope="module")
def module() -> Module:
    return Module(from_texts({"dense": TEXT, "entries": ENTRIES}))


def network(activation: str = "relu", **options: Any) -> QNetwork:
    return QNetwork(
        INPUTS, np.random.default_rng(0), capacity=EXAMPLES, activation=activation, **options
    )


def examples() -> tuple[np.ndarray, np.ndarray]:
    """As large as the NMPC's values, and not linear."""
    rows = np.random.default_rng(1).normal(size=(EXAMPLES, INPUTS)) * 3
    return rows, 1000 + 100 * np.abs(rows).sum(axis=1)


@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_webassembly_continues_a_network_with_the_same_mini_batches(module, activation):
    """Rounding is 6e-8."""
    native = network(activation)
    rows, targets = examples()
    for row, target in zip(rows[:200], targets, strict=False):
        native.remember(row, target)
    native.fit()
    *arrays, rate, sizes = native.net
    places, there = zip(*(module.put_bytes(each) for each in (*arrays, sizes)), strict=True)
    net = (*places[:-1], rate, places[-1], INPUTS, EXAMPLES)
    for row, target in zip(rows[200:], targets[200:], strict=True):
        native.remember(row, target)
        module("network_remember", *net, module.put(row), target)
    for _ in range(50):
        assert module("network_fit", *net) == pytest.approx(native.fit(), rel=1e-4)
    np.testing.assert_array_equal(there[2], native.net[2])
    np.testing.assert_array_equal(there[4], native.net[4])
    np.testing.assert_array_equal(there[3], [EXAMPLES, 51])
    distance = np.abs(there[0][0] - native.weights).max()
    assert distance < 1e-4 * np.abs(native.weights).max()
    found = [module("network_predict", *net, module.put(row)) for row in rows]
    expected = native.predict(rows)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


def test_webassembly_asks_its_host_for_a_power_and_nothing_else(module):
    assert module.imports == ["pow"]


def test_the_generator_is_splitmix64():
    """The numbers for this seed at https://rosettacode.org/wiki/Pseudo-random_numbers/Splitmix64."""
    draw = np.array([1234567], np.uint64)
    uniform = machine_code().dense.uniform.py_func
    with np.errstate(over="ignore"):
        found = [uniform(draw) for _ in range(5)]
    expected = [
        6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431,
        16408922859458223821,
    ]  # fmt: skip
    assert found == [number // 2**12 / 2**52 for number in expected]


def test_a_mini_batch_holds_no_example_twice_and_each_as_often():
    count, batch, fits = 20, 5, 4000
    learner = network(batch=batch, hidden=1)
    for row in examples()[0][:count]:
        learner.remember(row, 0.0)
    drawn = np.zeros(count)
    for _ in range(fits):
        learner.fit()
        order = learner.net[2][:count]
        assert len(set(order)) == count
        drawn[order[:batch]] += 1
    share = batch / count
    assert np.abs(drawn - fits * share).max() < 4 * np.sqrt(fits * share * (1 - share))
