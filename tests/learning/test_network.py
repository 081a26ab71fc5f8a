"""The network is torch's, forgets no example, disturbs no generator, and seeds decide its bits."""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch

from nmpcrl.learning import QNetwork
from nmpcrl.learning.network import Target, fit_in_torch, in_torch, machine_code, weights_of

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


def error(learner, examples):
    inputs, targets = examples
    return np.sqrt(np.mean((learner.predict(inputs) - targets) ** 2))


def beside_torch(inputs, activation="relu", seed=0):
    """A network, and torch's with the same first weights."""
    torch.manual_seed(int(np.random.default_rng(seed).integers(2**63)))
    model = in_torch(inputs, activation=activation)
    return taught(rows(300, inputs), seed=seed, activation=activation), model


def tensors(examples):
    return tuple(torch.from_numpy(np.asarray(part, np.float32)) for part in examples)


@pytest.mark.parametrize("inputs", [5, 14])
@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_it_is_torchs_network_and_adam_step_by_step(inputs, activation):
    """Rounding is 6e-8; over other seeds the largest distance is 7e-6 of the largest weight."""
    learner, model = beside_torch(inputs, activation)
    adam = torch.optim.Adam(model.parameters(), lr=1e-2)
    np.testing.assert_array_equal(learner.weights, weights_of(model))
    for _ in range(50):
        loss = learner.fit()
        drawn = learner.net[2][:128]
        expected = fit_in_torch(model, adam, *tensors(part[drawn] for part in rows(300, inputs)))
        assert loss == pytest.approx(expected, rel=1e-4)
        weights = weights_of(model)
        assert np.abs(learner.weights - weights).max() < 5e-5 * np.abs(weights).max()
    some, _ = rows(20, inputs, seed=2)
    expected = model(torch.from_numpy(some).float()).detach()
    np.testing.assert_allclose(learner.predict(some), expected, rtol=1e-3, atol=1e-4)


def test_the_gradient_is_that_of_autograd():
    learner, model = beside_torch(5)
    adam = torch.optim.SGD(model.parameters(), lr=1.0)
    before = weights_of(model)
    learner.fit()
    drawn = learner.net[2][:128]
    fit_in_torch(model, adam, *tensors(part[drawn] for part in rows(300, 5)))
    expected = before - weights_of(model)
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(learner.net[0][1], expected, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_it_learns_a_known_function(activation):
    learner, held_out = taught(rows(1000), activation=activation), rows(500, seed=2)
    before = error(learner, held_out)
    for _ in range(600):
        learner.fit()
    spread = held_out[1].std()
    assert before > 0.8 * spread
    assert error(learner, held_out) < 0.1 * spread


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("batch", [1, 3, 64])
def test_the_loss_is_the_mean_squared_error_before_the_step(options, batch):
    """In the caller's units, whatever the network divides by inside."""
    examples = rows(batch)
    learner = taught(examples, batch=batch, **options)
    before = error(learner, examples) ** 2
    assert learner.fit() == pytest.approx(before, rel=1e-5)
    assert error(learner, examples) ** 2 != pytest.approx(before, rel=1e-5)


def test_the_buffer_grows_past_its_capacity_and_keeps_every_row():
    """With a batch as large as the buffer, the loss is over every row that was remembered."""
    examples = rows(300)
    learner = taught(examples, batch=300, capacity=4)
    assert len(learner) == 300
    assert learner.fit() == pytest.approx(error(network(), examples) ** 2, rel=1e-5)


@pytest.mark.parametrize("capacity", [4, 64, 1024])
@pytest.mark.parametrize("count", [64, 65, 100, 300])
def test_with_a_memory_only_the_latest_examples_are_kept(count, capacity):
    """With a batch as large as the memory, the loss is over every row that is left."""
    inputs, targets = rows(count)
    learner = taught((inputs, targets), batch=64, memory=64, capacity=capacity)
    assert len(learner) == 64
    expected = error(network(), (inputs[-64:], targets[-64:])) ** 2
    assert learner.fit() == pytest.approx(expected, rel=1e-5)


def test_a_memory_that_is_not_full_changes_nothing():
    limited, unlimited = taught(rows(200), memory=200), taught(rows(200))
    assert [limited.fit() for _ in range(5)] == [unlimited.fit() for _ in range(5)]
    np.testing.assert_array_equal(limited.weights, unlimited.weights)


def test_compiled_code_has_as_much_room_as_was_reserved():
    learner = network(capacity=4)
    learner.reserve(10)
    for _ in range(len(learner.net[1])):
        machine_code().remember(learner.net, np.zeros(2), 0.0)
    with pytest.raises(IndexError, match="no room for another example"):
        machine_code().remember(learner.net, np.zeros(2), 0.0)
    assert len(learner) >= 10


def test_it_is_ready_once_it_holds_a_batch():
    learner = network(batch=3)
    ready = []
    for _ in range(4):
        ready.append(learner.ready)
        learner.remember(np.zeros(2), 0.0)
    assert ready == [False, False, False, True]


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


def test_torchs_own_generator_neither_decides_the_weights_nor_moves():
    predictions = []
    for seed in (1, 2):
        torch.manual_seed(seed)
        before = torch.random.get_rng_state()
        predictions.append(network().predict(rows(10)[0]))
        assert torch.equal(torch.random.get_rng_state(), before)
    np.testing.assert_array_equal(*predictions)


def test_networks_that_begin_at_once_in_several_threads_begin_as_they_do_alone():
    alone = [network(seed=seed).weights for seed in range(200)]
    with ThreadPoolExecutor(4) as threads:
        together = threads.map(lambda seed: network(seed=seed).weights, range(200))
        np.testing.assert_array_equal(alone, list(together))


def test_what_a_program_makes_torchs_default_type_changes_no_weight():
    torch.set_default_dtype(torch.float64)
    try:
        found = network().weights
    finally:
        torch.set_default_dtype(torch.float32)
    np.testing.assert_array_equal(found, network().weights)


def test_seeds_decide_every_bit():
    learners = [taught(rows(200), seed=seed) for seed in (5, 5, 6)]
    losses = [[learner.fit() for _ in range(20)] for learner in learners]
    assert losses[0] == losses[1] != losses[2]


def test_it_predicts_one_input_or_many_and_learns_nothing_from_it():
    learner, (inputs, _) = network(), rows(15)
    many = learner.predict(inputs.reshape(3, 5, 2))
    assert many.shape == (3, 5)
    one = learner.predict(inputs[0])
    assert one.shape == ()
    assert float(one) == pytest.approx(many[0, 0], rel=1e-6)
    np.testing.assert_array_equal(learner.predict(inputs.reshape(3, 5, 2)), many)


def test_scales_are_as_if_the_caller_had_divided():
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
    def begun():
        learner = taught(rows(140), memory=200, capacity=8, **options)
        learner.fit()
        return learner

    def go_on(learner):
        for inputs, value in zip(*rows(150, seed=3), strict=True):
            learner.remember(inputs, value)
            learner.fit()
        return learner.predict(rows(9)[0])

    original, expected = begun(), go_on(begun())
    twin = again(original)
    np.testing.assert_array_equal(go_on(twin), expected)
    np.testing.assert_array_equal(go_on(original), expected)


@pytest.mark.parametrize("again", [copy.deepcopy, PICKLED])
def test_the_copy_of_a_target_follows_the_copy_of_its_network(again):
    learner = taught(rows(140))
    target, twin = again((Target(learner, rate=0.5), learner))
    before = target.predict(rows(9)[0])
    twin.fit()
    target.follow()
    assert not np.array_equal(target.predict(rows(9)[0]), before)
    assert target.fitted
    assert not learner.fitted
