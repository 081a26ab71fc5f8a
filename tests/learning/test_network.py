"""The network is torch's, forgets no example, disturbs no generator, and seeds decide its bits."""

import copy
import pickle

import numpy as np
import pytest
import torch

from nmpcrl.learning import QNetwork
from nmpcrl.learning.network import fit_in_torch, in_torch, weights_of

SCALED = {"scales": (np.array([4.0, 0.3]), 250.0)}  # for two inputs
OPTIONS = [{}, {"activation": "tanh"}, SCALED, {"activation": "tanh", **SCALED}]
PICKLED = lambda x: pickle.loads(pickle.dumps(x))  # noqa: E731


def network(inputs=2, seed=0, **options):
    return QNetwork(inputs, np.random.default_rng(seed), **options)


def rows(count, inputs=2, seed=1):
    drawn = np.random.default_rng(seed).uniform(-1, 1, (count, inputs))
    return drawn, 3 * drawn[:, 0] ** 2 - drawn[:, 1]


def taught(examples, **options):
    learner = network(examples[0].shape[1], **options)
    for inputs, target in zip(*examples, strict=True):
        learner.remember(inputs, target)
    return learner


def squared_error(learner, examples):
    inputs, targets = examples
    return np.mean((learner.predict(inputs) - targets) ** 2)


def beside_torch(inputs, activation="relu"):
    """A network, and torch's with the same first weights."""
    torch.manual_seed(int(np.random.default_rng(0).integers(2**63)))
    return taught(rows(300, inputs), activation=activation), in_torch(inputs, 64, activation)


def drawn_by(learner, inputs):
    """The mini-batch of its last fit."""
    drawn = learner.net[2][:128]
    return (torch.from_numpy(part[drawn].astype(np.float32)) for part in rows(300, inputs))


@pytest.mark.parametrize("inputs", [5, 14])
@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_it_is_torchs_network_and_adam_step_by_step(inputs, activation):
    """Rounding is 6e-8; over other seeds the largest distance is 7e-6 of the largest weight."""
    learner, model = beside_torch(inputs, activation)
    adam = torch.optim.Adam(model.parameters(), lr=1e-2)
    np.testing.assert_array_equal(learner.weights, weights_of(model))
    for _ in range(50):
        loss = learner.fit()
        expected = fit_in_torch(model, adam, *drawn_by(learner, inputs))
        assert loss == pytest.approx(expected, rel=1e-4)
        weights = weights_of(model)
        assert np.abs(learner.weights - weights).max() < 5e-5 * np.abs(weights).max()
    some, _ = rows(20, inputs, seed=2)
    expected = model(torch.from_numpy(some).float()).detach()
    np.testing.assert_allclose(learner.predict(some), expected, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("batch", [1, 3, 64])
def test_the_loss_is_the_mean_squared_error_before_the_step(options, batch):
    """In the caller's units, whatever the network divides by inside."""
    examples = rows(batch)
    learner = taught(examples, batch=batch, **options)
    before = squared_error(learner, examples)
    assert learner.fit() == pytest.approx(before, rel=1e-5)
    assert squared_error(learner, examples) != pytest.approx(before, rel=1e-5)


@pytest.mark.parametrize("memory", [None, 64])
@pytest.mark.parametrize("capacity", [4, 64, 1024])
@pytest.mark.parametrize("count", [64, 65, 300])
def test_every_row_is_remembered_or_the_latest_ones_of_a_memory(count, capacity, memory):
    """With a batch as large as the buffer, the loss is over every row in it."""
    (inputs, targets), left = rows(count), memory or count
    learner = taught((inputs, targets), batch=left, memory=memory, capacity=capacity)
    assert len(learner) == left
    expected = squared_error(network(), (inputs[-left:], targets[-left:]))
    assert learner.fit() == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    ("message", "refused"),
    [
        ("127 examples are too few for a batch of 128", lambda: taught(rows(127)).fit()),
        ("memory = 127 must hold at least a batch of 128", lambda: network(memory=127)),
        ("activation = 'gelu' must be one of relu, tanh", lambda: network(activation="gelu")),
        ("inputs of length 3 must have length 2", lambda: network().predict(np.zeros((4, 3)))),
        ("inputs of length 3 must have length 2", lambda: network().remember(np.zeros(3), 0.0)),
    ],
)
def test_nonsense_is_refused(message, refused):
    with pytest.raises(ValueError, match=message):
        refused()


def test_seeds_decide_every_bit_and_many_inputs_or_scales_are_as_one_by_one_and_divided():
    options = {"seed": 5}, {"seed": 5}, {"seed": 5, "memory": 200}, {"seed": 6}
    learners = [taught(rows(200), **one) for one in options]
    one, same, limited, other = ([learner.fit() for _ in range(20)] for learner in learners)
    assert one == same == limited != other
    learner, (inputs, _) = network(), rows(15)
    many, one = learner.predict(inputs.reshape(3, 5, 2)), learner.predict(inputs[0])
    assert (many.shape, one.shape) == ((3, 5), ())
    assert float(one) == pytest.approx(many[0, 0], rel=1e-6)
    np.testing.assert_array_equal(learner.predict(inputs.reshape(3, 5, 2)), many)
    inputs, targets = rows(200)
    input_scale, target_scale = SCALED["scales"]
    scaled = taught((inputs, targets), **SCALED)
    plain = taught((inputs / input_scale, targets / target_scale))
    for _ in range(20):
        assert scaled.fit() == pytest.approx(plain.fit() * target_scale**2, rel=1e-12)
    expected = plain.predict(inputs / input_scale) * target_scale
    np.testing.assert_array_equal(scaled.predict(inputs), expected)


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, PICKLED])
def test_a_copy_goes_on_as_the_original_does_without_it(again, options):
    original, alone = (taught(rows(140), memory=200, capacity=8, **options) for _ in range(2))
    original.fit()
    alone.fit()
    twin, predictions = again(original), []
    for learner in (alone, twin, original):
        for inputs, value in zip(*rows(150, seed=3), strict=True):
            learner.remember(inputs, value)
            learner.fit()
        predictions.append(learner.predict(rows(9)[0]))
    np.testing.assert_array_equal(predictions, predictions[:1] * 3)


def test_a_mini_batch_holds_no_example_twice_and_each_as_often():
    count, batch, fits = 20, 5, 4000
    learner, drawn = taught(rows(count), batch=batch, hidden=1), np.zeros(count)
    for _ in range(fits):
        learner.fit()
        order = learner.net[2][:count]
        assert len(set(order)) == count
        drawn[order[:batch]] += 1
    share = batch / count
    assert np.abs(drawn - fits * share).max() < 4 * np.sqrt(fits * share * (1 - share))
