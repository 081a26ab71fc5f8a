"""The network: it learns, forgets no row, disturbs no generator, and seeds decide its bits."""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch

from nmpcrl.learning import QNetwork
from nmpcrl.learning.network import Target

SCALED = {"scales": (np.array([4.0, 0.3]), 250.0)}  # for two inputs
OPTIONS = [{}, {"activation": "tanh"}, SCALED, {"activation": "tanh", **SCALED}]


def network(inputs=2, seed=0, **options):
    return QNetwork(inputs, np.random.default_rng(seed), **options)


def rows(count, inputs=2, seed=1):
    drawn = np.random.default_rng(seed).uniform(-1, 1, (count, inputs))
    return drawn, 3 * drawn[:, 0] ** 2 - drawn[:, 1]


def taught(examples, **options):
    learner = network(**options)
    for inputs, target in zip(*examples, strict=True):
        learner.remember(inputs, target)
    return learner


def error(learner, examples):
    inputs, targets = examples
    return np.sqrt(np.mean((learner.predict(inputs) - targets) ** 2))


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
def test_the_loss_is_the_mean_squared_error_before_the_step(options):
    """In the caller's units, whatever the network divides by inside."""
    examples = rows(64)
    learner = taught(examples, batch=64, **options)
    before = error(learner, examples) ** 2
    assert learner.fit() == pytest.approx(before, rel=1e-5)
    assert error(learner, examples) ** 2 != pytest.approx(before, rel=1e-5)


def test_the_buffer_grows_past_its_capacity_and_keeps_every_row():
    """With a batch as large as the buffer, the loss is over every row that was remembered."""
    examples = rows(300)
    learner = taught(examples, batch=300, capacity=4)
    assert len(learner) == 300
    assert learner.fit() == pytest.approx(error(learner_like(examples), examples) ** 2, rel=1e-5)


def learner_like(examples):
    """The same first weights, and a buffer that never had to grow."""
    return taught(examples, batch=300, capacity=1000)


def model_of(learner, activation=torch.nn.ReLU):
    """The same network of torch's modules, which autograd differentiates."""
    layers = [W.clone() for W in learner._matrices[0]]
    linear = [torch.nn.Linear(len(W) - 1, W.shape[1]) for W in layers]
    for module, W in zip(linear, layers, strict=True):
        module.weight.data, module.bias.data = W[:-1].T.contiguous(), W[-1]
    return torch.nn.Sequential(
        linear[0], activation(), linear[1], activation(), linear[2], torch.nn.Flatten(0)
    )


def in_one_vector(model, part=lambda parameter: parameter.detach()):
    """Weights, or `part` of them, in the order of `QNetwork`."""
    pairs = [(part(m.weight), part(m.bias)) for m in model if isinstance(m, torch.nn.Linear)]
    return torch.cat([torch.cat([weight.T, bias[None]]).flatten() for weight, bias in pairs])


def beside_modules(inputs=14, activation="relu", **options):
    """A network, its modules, and a function for their loss that leaves its gradient in them."""
    examples = rows(128, inputs)
    learner = taught(examples, inputs=inputs, activation=activation, **options)
    model = model_of(learner, {"relu": torch.nn.ReLU, "tanh": torch.nn.Tanh}[activation])
    x, target = (torch.from_numpy(part).float() for part in examples)

    def loss():
        model.zero_grad()
        value = torch.nn.functional.mse_loss(model(x), target)
        value.backward()
        return value.item()

    return learner, model, loss


@pytest.mark.parametrize("inputs", [2, 5, 14])
@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_the_gradient_is_that_of_autograd(inputs, activation):
    learner, model, loss = beside_modules(inputs, activation)
    assert learner.fit() == pytest.approx(loss(), rel=1e-5)
    expected = in_one_vector(model, lambda parameter: parameter.grad)
    assert expected.abs().max() > 0.1
    torch.testing.assert_close(learner._gradient, expected, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_it_descends_as_torchs_adam_does(activation):
    learner, model, loss = beside_modules(activation=activation, learning_rate=1e-3)
    adam = torch.optim.Adam(model.parameters(), lr=1e-3)
    for _ in range(30):
        assert learner.fit() == pytest.approx(loss(), rel=1e-4)
        adam.step()
    torch.testing.assert_close(learner._weights, in_one_vector(model), rtol=1e-3, atol=1e-4)


def test_the_first_weights_are_those_of_torchs_linear_layers():
    torch.manual_seed(int(np.random.default_rng(7).integers(2**63)))
    sizes = [(14, 64), (64, 64), (64, 1)]
    model = torch.nn.Sequential(*(torch.nn.Linear(*size) for size in sizes))
    assert torch.equal(network(inputs=14, seed=7)._weights, in_one_vector(model))


def test_it_predicts_what_torchs_modules_do():
    learner, inputs = network(), rows(20)[0]
    expected = model_of(learner)(torch.from_numpy(inputs).float()).detach()
    np.testing.assert_allclose(learner.predict(inputs), expected, rtol=1e-5, atol=1e-6)


def test_it_is_ready_once_it_holds_a_batch():
    learner = network(batch=3)
    ready = []
    for _ in range(4):
        ready.append(learner.ready)
        learner.remember(np.zeros(2), 0.0)
    assert ready == [False, False, False, True]


def test_too_few_examples_cannot_be_fitted():
    learner = taught(rows(127))
    with pytest.raises(ValueError, match="127 examples are too few for a batch of 128"):
        learner.fit()


def test_a_mini_batch_has_no_row_twice():
    """Drawn with replacement, 64 of 64 rows would miss some, and the loss would differ."""
    for seed in range(5):
        examples = rows(64, seed=seed)
        learner = taught(examples, batch=64)
        assert learner.fit() == pytest.approx(error(network(), examples) ** 2, rel=1e-5)


def test_torchs_own_generator_is_left_alone():
    torch.manual_seed(99)  # or a network of an earlier test might have left this very state
    before = torch.random.get_rng_state()
    learner = taught(rows(128))
    learner.fit()
    learner.predict(np.zeros(2))
    assert torch.equal(torch.random.get_rng_state(), before)


def test_torchs_own_generator_does_not_decide_the_weights():
    predictions = []
    for seed in (1, 2):
        torch.manual_seed(seed)
        predictions.append(network().predict(rows(10)[0]))
    np.testing.assert_array_equal(*predictions)


def train(seed):
    learner = taught(rows(200), seed=seed)
    losses = [learner.fit() for _ in range(20)]
    return losses, learner.predict(rows(10)[0])


def test_the_same_seed_gives_the_same_bits():
    (losses, predictions), (again, repeated) = train(5), train(5)
    assert losses == again
    np.testing.assert_array_equal(predictions, repeated)


def test_another_seed_gives_others():
    assert not np.array_equal(train(5)[1], train(6)[1])


def test_it_predicts_one_input_or_many():
    learner, (inputs, _) = network(), rows(12)
    many = learner.predict(inputs.reshape(3, 4, 2))
    assert many.shape == (3, 4)
    one = learner.predict(inputs[0])
    assert one.shape == ()
    assert float(one) == pytest.approx(many[0, 0], rel=1e-6)


def test_predicting_teaches_nothing():
    learner = taught(rows(128))
    before = learner.predict(rows(5)[0])
    np.testing.assert_array_equal(learner.predict(rows(5)[0]), before)
    assert len(learner) == 128


def test_it_has_two_hidden_layers_of_64():
    """With 14 inputs, (14 + 1) 64 + (64 + 1) 64 + 65 weights: Table I."""
    assert len(network(inputs=14)._weights) == 15 * 64 + 65 * 64 + 65


def test_what_it_is_told_is_copied():
    """The caller may reuse its array."""
    learner, inputs = network(batch=1), np.ones(2)
    learner.remember(inputs, 1.0)
    expected = (float(learner.predict(inputs)) - 1.0) ** 2
    inputs[:] = 50.0
    assert learner.fit() == pytest.approx(expected, rel=1e-5)


def test_scales_are_as_if_the_caller_had_divided():
    inputs, targets = rows(200)
    input_scale, target_scale = SCALED["scales"]
    scaled = taught((inputs, targets), **SCALED)
    plain = taught((inputs / input_scale, targets / target_scale))
    for _ in range(20):
        assert scaled.fit() == pytest.approx(plain.fit() * target_scale**2, rel=1e-12)
    for some in (inputs[:7], inputs[0]):
        np.testing.assert_array_equal(
            scaled.predict(some), plain.predict(some / input_scale) * target_scale
        )


def test_with_scales_a_large_target_is_learned_as_fast_as_a_small_one():
    """Adam's steps are as long for either, so without scales the large one stays far away."""
    inputs, targets = rows(1000)
    large = (inputs, 1000 + 1000 * targets)
    scaled, plain = taught(large, scales=(1.0, 1000.0)), taught(large)
    for _ in range(300):
        scaled.fit()
        plain.fit()
    spread = large[1].std()
    assert error(scaled, large) < 0.2 * spread
    assert error(plain, large) > 2 * error(scaled, large)


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
    np.testing.assert_array_equal(limited._weights, unlimited._weights)


def test_a_memory_smaller_than_a_mini_batch_is_refused():
    with pytest.raises(ValueError, match="memory = 127 must hold at least a batch of 128"):
        network(memory=127)


def test_an_activation_that_is_not_known_is_refused():
    with pytest.raises(ValueError, match="activation = 'gelu' must be one of relu, tanh"):
        network(activation="gelu")


def test_a_room_for_few_predictions_is_used_again_and_changes_none():
    learner = taught(rows(200))
    some, others = rows(9)[0], rows(9, seed=3)[0]
    first = learner.predict(some)
    learner.predict(others)
    np.testing.assert_array_equal(learner.predict(some), first)
    for _ in range(5):
        learner.fit()
    np.testing.assert_allclose(learner.predict(some)[4], learner.predict(some[4]), rtol=1e-5)
    assert not np.array_equal(learner.predict(some), first)


def test_networks_that_begin_at_once_in_several_threads_begin_as_they_do_alone():
    alone = [network(seed=seed).predict(rows(10)[0]) for seed in range(200)]
    with ThreadPoolExecutor(4) as threads:
        together = threads.map(lambda seed: network(seed=seed).predict(rows(10)[0]), range(200))
        np.testing.assert_array_equal(alone, list(together))


def test_what_a_program_makes_torchs_default_type_changes_no_bit():
    before = train(5)
    torch.set_default_dtype(torch.float64)
    try:
        after = train(5)
    finally:
        torch.set_default_dtype(torch.float32)
    assert before[0] == after[0]
    np.testing.assert_array_equal(before[1], after[1])


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize(
    "again", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
)
def test_a_copy_goes_on_as_the_original_does_without_it(again, options):
    def begun():
        learner = taught(rows(140), memory=200, capacity=8, **options)
        learner.fit()
        learner.predict(rows(9)[0])
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


@pytest.mark.parametrize("again", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_the_copy_of_a_target_follows_the_copy_of_its_network(again):
    learner = taught(rows(140))
    target, twin = again((Target(learner, rate=0.5), learner))
    before = target.predict(rows(9)[0])
    twin.fit()
    target.follow()
    assert not np.array_equal(target.predict(rows(9)[0]), before)
    assert target.fitted
    assert not learner.fitted


def test_the_programs_number_of_threads_is_left_alone_and_changes_no_bit():
    found = []
    for count in (1, 2):
        torch.set_num_threads(count)
        found.append(train(5))
        assert torch.get_num_threads() == count
    torch.set_num_threads(1)
    np.testing.assert_array_equal(found[0][1], found[1][1])
