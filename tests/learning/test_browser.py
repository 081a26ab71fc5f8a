"""Whole training runs through the WebAssembly module are those of the library."""

from dataclasses import replace

import numpy as np
import pytest
from wasm_host import Controller, Module

from nmpcrl.learning import updates
from nmpcrl.study import Experiment, paper, run
from nmpcrl.study.setup import prepare

pytestmark = pytest.mark.slow

RUNS = [
    Experiment(learner=learner, layout=layout, decay=decay, episodes=20, **options)
    for learner, layout, decay, options in (
        ("ES", "C", "episode", {}),
        ("ES", "A", "episode", {"seed": 3, "alpha": 3e-8}),
        ("GES", "D", "step", {"seed": 1}),
        ("GES", "E", "step", {}),
        ("TDC", "D", "episode", {"seed": 1}),
        ("QL", "D", "step", {"constrained": True}),
    )
]

# What Python's own runs allow. Where the last bit of alpha is another, or the processor, ES and GES
# differ from themselves by up to 3e-14 here; QL by 2e-9, since an action may take the robot to an
# obstacle's edge, where the value has a kink; and TDC by more than 1e-10, since products with the
# Hessian lose digits where constraints are active. The two runs of QL agree to 2e-9.
DIGITS = {"ES": 1e-12, "GES": 1e-12, "QL": 5e-9, "TDC": 1e-9}


class Rules:
    """The exported update rules, on arrays."""

    def __init__(self, module: Module, d: int) -> None:
        self.module, self.d = module, d
        self.room = [module.put(np.zeros(d)) for _ in range(5)]

    def __call__(self, name: str, *arguments):
        """Vectors are put at places of their own, numbers go as they are."""
        given, places = [], iter(self.room)
        for each in arguments:
            if np.ndim(each):
                place = next(places)
                self.module.write(place, each)
                given.append(place)
            else:
                given.append(float(each))
        out = self.room[-1]
        self.module(f"rule_{name}", self.d, *given, out)
        return self.module.read(out, self.d)


def learned(data: bytes, experiment: Experiment) -> np.ndarray:
    """theta after each step, as a browser learns it: Algorithm 1 on the module's functions."""
    nmpc = paper.nmpc(experiment.layout)
    module = Module(data)
    there, rules = Controller(module, nmpc), Rules(module, 9)
    _, weights, explore = prepare(experiment, nmpc)
    theta, w, thetas = weights.theta, weights.w, []
    alpha, beta, gamma = experiment.alpha, experiment.beta, nmpc.gamma
    beta = experiment.beta_tdc if experiment.learner == "TDC" else beta
    for episode in range(experiment.episodes):
        state, warm = nmpc.task.start, None
        for t in range(experiment.steps):
            plan = there.solve(state, theta, warm)
            action = nmpc.plant.clip(explore(plan["action"], episode, t))
            now = there.solve(state, theta, plan, action) if experiment.learner == "QL" else plan
            cost, later = there.cost(state, action), there.step(state, action)
            warm = there.solve(later, theta, now)
            delta = module("rule_td_error", cost, gamma, now["value"], warm["value"])
            phi, phi_next = now["features"], warm["features"]
            if experiment.learner in ("ES", "QL"):
                theta = rules("semi_gradient", theta, delta, phi, alpha)
            else:
                old_w = w
                moved = rules("gradient_td", theta, w, delta, phi, phi_next, alpha, gamma)
                w = rules("auxiliary", w, delta, phi, beta)
                if experiment.learner == "TDC":
                    product = there.slopes(state, theta, plan, old_w)
                    h = rules("curvature", delta, phi, old_w, product)
                    moved = rules("project", moved - alpha * h, *paper.THETA_SET)
                theta = moved
            thetas.append(theta)
            state = later
    return np.array(thetas)


def difference(found: np.ndarray, expected: np.ndarray) -> float:
    """The largest one of theta in any step, relative to the largest theta."""
    assert found.shape == expected.shape
    return float(np.abs(found - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize("experiment", RUNS, ids=str)
def test_a_run_is_that_of_the_library(robot_module, experiment):
    expected = run(experiment).steps["theta"]
    assert difference(learned(robot_module, experiment), expected) < DIGITS[experiment.learner]


@pytest.mark.parametrize("learner", ["QL", "TDC"])
def test_the_library_has_no_more_digits_of_its_own(learner):
    """A tenth of its tolerance is less than what the last bit of alpha does to a run in Python."""
    experiment = next(one for one in RUNS if (one.learner, one.layout) == (learner, "D"))
    expected = run(experiment).steps["theta"]
    nearest = (float(np.nextafter(experiment.alpha, side)) for side in (0.0, 1.0))
    own = [run(replace(experiment, alpha=alpha)).steps["theta"] for alpha in nearest]
    assert max(difference(one, expected) for one in own) > DIGITS[learner] / 10


def test_the_rules_are_those_of_the_library_in_every_digit(robot_module):
    """So what runs differ by comes from solves and products, and not from the order of sums."""
    rules, rng = Rules(Module(robot_module), 9), np.random.default_rng(0)
    for _ in range(20):
        theta, w, phi, phi_next, product = rng.normal(size=(5, 9))
        delta, alpha, gamma = rng.uniform(size=3)
        found = (
            rules("semi_gradient", theta, delta, phi, alpha),
            rules("gradient_td", theta, w, delta, phi, phi_next, alpha, gamma),
            rules("auxiliary", w, delta, phi, alpha),
            rules("curvature", delta, phi, w, product),
        )
        expected = (
            updates.semi_gradient_step(theta, delta, phi, alpha),
            updates.gradient_td_step(theta, w, delta, phi, phi_next, alpha=alpha, gamma=gamma),
            updates.auxiliary_step(w, delta, phi, alpha),
            updates.curvature_correction(delta, phi, w, product),
        )
        assert max(map(difference, found, expected)) < 1e-14
