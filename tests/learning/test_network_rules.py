"""The network that a browser fits is that of `QNetwork`, but for the order of its sums."""

from importlib.resources import files

import numpy as np
import pytest
from wasm_host import Module

from nmpcrl.control.codegen.browser import from_texts
from nmpcrl.learning.network import QNetwork

BATCH, HIDDEN, RATE = 128, 64, 1e-2
INPUTS = {"DES": 5, "RDES": 14}
EXAMPLES = 300


@pytest.fixture(scope="module")
def network_module() -> bytes:
    text = files("nmpcrl.learning").joinpath("network_rules.py").read_text("utf-8")
    return from_texts({"network_rules": text})


class Pair:
    """A network of torch's and its like in a module: the same first weights, the same batches."""

    def __init__(self, data: bytes, inputs: int) -> None:
        rng = np.random.default_rng(inputs)
        self.torch = QNetwork(inputs, rng, RATE, BATCH, HIDDEN)
        self.examples = rng.normal(size=(EXAMPLES, inputs)) * 3
        for example in self.examples:  # as large as the NMPC's values, and not linear
            self.torch.remember(example, 1000 + 100 * np.abs(example).sum())
        self.module, self.inputs, self.fits = Module(data), inputs, 0
        first = self.torch._weights.numpy()
        self._rows, self._drawn = self.module.put_singles(np.ones((BATCH, inputs + 2)))
        self._row, self._one = self.module.put_singles(np.ones(inputs + 1))
        self._at, vectors = zip(
            *(self.module.put_singles(each) for each in (first, 0 * first, 0 * first)), strict=True
        )
        self.weights = vectors[0]

    def fit(self) -> tuple[float, float]:
        """The loss of both, before the step."""
        expected = self.torch.fit()
        self._drawn[:] = self.torch._drawn
        self.fits += 1
        sizes = self.inputs, HIDDEN, BATCH
        loss = self.module("network_fit", *sizes, self._rows, *self._at, RATE, self.fits)
        return loss, expected

    def predict(self, example: np.ndarray) -> float:
        self._one[:-1] = example
        return self.module("network_predict", self.inputs, HIDDEN, self._row, self._at[0])


@pytest.fixture(params=INPUTS)
def pair(request, network_module) -> Pair:
    return Pair(network_module, INPUTS[request.param])


def distance(pair: Pair) -> float:
    """Of the weights, as a share of the largest."""
    expected = pair.torch._weights.numpy()
    return np.abs(pair.weights - expected).max() / np.abs(expected).max()


@pytest.mark.parametrize(("fits", "digits"), [(1, 1e-6), (50, 1e-4)])
def test_fits_are_those_of_torch(pair, fits, digits):
    """Rounding is 6e-8; the largest distances seen are 1e-7 after one fit and 2e-6 after 100."""
    before = pair.weights.copy()
    for _ in range(fits):
        loss, expected = pair.fit()
        assert loss == pytest.approx(expected, rel=1e-4)
    assert np.abs(pair.weights - before).max() > 0.9 * RATE
    assert distance(pair) < digits


def test_predictions_are_those_of_torch(pair):
    for _ in range(20):
        pair.fit()
    expected = pair.torch.predict(pair.examples)
    found = [pair.predict(example) for example in pair.examples]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def test_the_loss_falls(pair):
    losses = [pair.fit()[0] for _ in range(100)]
    assert np.mean(losses[-10:]) < 0.5 * np.mean(losses[:10])


def test_a_module_of_the_network_asks_its_host_for_nothing_else(network_module):
    assert set(Module(network_module).imports) <= {"cos", "log", "pow", "sin"}
