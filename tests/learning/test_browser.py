"""Whole training runs through the WebAssembly module are those of the library."""

import numpy as np
import pytest
from wasm_host import Module

from nmpcrl.control import browser
from nmpcrl.control.nmpc import ABSURD
from nmpcrl.learning import loop, updates
from nmpcrl.learning.episode import NO_NETWORK, NUMBERS
from nmpcrl.study import Experiment, paper, run
from nmpcrl.study.setup import controller_of, prepare

pytestmark = pytest.mark.slow

RUNS = [
    Experiment(learner=learner, layout=layout, decay=decay, episodes=20, **options)
    for learner, layout, decay, options in (
        ("ES", "A", "step", {}),
        ("ES", "C", "episode", {}),
        ("ES", "A", "episode", {"seed": 3, "alpha": 3e-8}),
        ("GES", "A", "step", {}),
        ("GES", "D", "step", {"seed": 1}),
        ("GES", "E", "step", {}),
        ("TDC", "D", "episode", {"seed": 1}),
        ("QL", "D", "step", {"constrained": True}),
        ("frozen", "B", "step", {}),
    )
]
NETWORKS = [Experiment(learner=name, episodes=3, seed=1) for name in ("DES", "RDES")]

# What Python's own runs allow. Where the last bit of alpha is another, or the processor, ES and GES
# differ from themselves by up to 3e-14 here; QL by 3e-10, since an action may take the robot to an
# obstacle's edge, where the value has a kink; and TDC by 2e-10, since products with the Hessian
# lose digits where constraints are active.
DIGITS = {"ES": 1e-12, "GES": 1e-12, "QL": 2e-9, "TDC": 1e-9, "frozen": 0.0}
LEARNERS = {  # rule, bootstrap, whether theta is an input of the network
    "ES": (loop.SEMI_GRADIENT, loop.SECOND_SOLVE, 0),
    "DES": (loop.SEMI_GRADIENT, loop.NETWORK, 0),
    "RDES": (loop.SEMI_GRADIENT, loop.NETWORK, 1),
    "GES": (loop.GRADIENT_TD, loop.SECOND_SOLVE, 0),
    "TDC": (loop.EXACT, loop.SECOND_SOLVE, 0),
    "QL": (loop.SEMI_GRADIENT, loop.SECOND_SOLVE, 0),
    "frozen": (loop.SEMI_GRADIENT, loop.NOTHING, 0),
}


def learned(data: bytes, experiment: Experiment) -> dict[str, np.ndarray]:
    """theta, w and value of each step, as a browser learns them: the module makes each step."""
    nmpc, module = controller_of(experiment), Module(data)
    learner, weights, explore = prepare(experiment, nmpc)
    rule, bootstrap, with_theta = LEARNERS[experiment.learner]
    beta = experiment.beta_tdc if experiment.learner == "TDC" else experiment.beta
    bounds = paper.THETA_SET if experiment.learner == "TDC" else (-np.inf, np.inf)
    how = [
        rule, experiment.alpha, beta, bootstrap, with_theta, experiment.values_actions,
        experiment.tolerance, nmpc.farthest, ABSURD, *np.repeat(bounds, 9),
    ]  # fmt: skip
    net = NO_NETWORK
    if bootstrap == loop.NETWORK:
        learner.bootstrap.network.reserve(experiment.episodes * experiment.steps)
        net = learner.bootstrap.network.net
    *arrays, rate, sizes = net
    places = [module.put(each, each.dtype) for each in (*arrays, sizes)]
    inputs = arrays[1].shape[1] - (bootstrap == loop.NETWORK)
    network = (*places[:-1], rate, places[-1], inputs, len(arrays[1]))
    problem = module.put(browser.packed(browser.problem(nmpc.problem, nmpc.solver)))
    warm = module.put(np.zeros(2 * nmpc.ocp.lower.size + nmpc.ocp.equality.size))
    width = len(NUMBERS) + nmpc.n + nmpc.m + 27
    how, state, theta, w, noise, row = (
        module.put(each)
        for each in (how, nmpc.task.start, weights.theta, weights.w, [0, 0], np.zeros(width))
    )
    rows = []
    for noises in explore.scaled:
        module.write(state, nmpc.task.start)
        for t, each in enumerate(noises):
            module.write(noise, each)
            assert module(
                "learn", problem, how, *network, state, theta, w, warm, t == 0, noise, row
            )
            rows.append(module.read(row, width))
    rows = np.array(rows)
    return {"theta": rows[:, -18:-9], "w": rows[:, -9:], "value": rows[:, NUMBERS.index("value")]}


def difference(found: np.ndarray, expected: np.ndarray) -> float:
    """The largest one of theta in any step, relative to the largest theta."""
    assert found.shape == expected.shape
    return float(np.abs(found - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize("experiment", RUNS, ids=str)
def test_a_run_is_that_of_the_library(robot_module, experiment):
    found, expected = learned(robot_module, experiment), run(experiment).steps
    for name in ("theta", "w"):
        assert difference(found[name], expected[name]) <= DIGITS[experiment.learner]


@pytest.mark.parametrize("experiment", NETWORKS, ids=str)
def test_a_run_with_a_network_is_that_of_the_library_to_single_precision(robot_module, experiment):
    found, expected = learned(robot_module, experiment), run(experiment).steps
    before = paper.BATCH - 1  # steps without a fit
    np.testing.assert_array_equal(found["theta"][:before], expected["theta"][:before])
    assert difference(found["theta"], expected["theta"]) < 1e-5


def test_the_rules_are_those_of_the_library_to_the_last_bit(robot_module):
    """So what runs differ by comes from solves and products, and not from the order of sums."""
    module, rng = Module(robot_module), np.random.default_rng(0)
    for _ in range(20):
        theta, w, phi, phi_next = rng.normal(size=(4, 9))
        delta, alpha, beta, gamma = rng.uniform(size=4)
        expected = {
            loop.SEMI_GRADIENT: (updates.semi_gradient_step(theta, delta, phi, alpha), w),
            loop.GRADIENT_TD: (
                updates.gradient_td_step(theta, w, delta, phi, phi_next, alpha=alpha, gamma=gamma),
                updates.auxiliary_step(w, delta, phi, beta),
            ),
        }
        for rule, (theta_after, w_after) in expected.items():
            places = [module.put(each) for each in (theta, w, phi, phi_next)]
            module("moved", rule, 9, *places[:2], delta, *places[2:], alpha, beta, gamma)
            np.testing.assert_array_equal(module.read(places[0], 9), theta_after)
            np.testing.assert_array_equal(module.read(places[1], 9), w_after)
        assert module("td_error", *phi[:4]) == updates.td_error(*phi[:4])
