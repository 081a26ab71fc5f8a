"""Whole training runs through the WebAssembly module are those of the library."""

import numpy as np
import pytest
from wasm_host import Controller, Module

from nmpcrl.learning.rollout import Persistent
from nmpcrl.study import Experiment, paper, run
from nmpcrl.study.setup import prepare

pytestmark = pytest.mark.slow

RUNS = [
    Experiment(learner=learner, layout=layout, decay=decay, episodes=20, **options)
    for learner, layout, decay, options in (
        ("ES", "A", "step", {}),
        ("ES", "B", "step", {}),
        ("ES", "C", "episode", {}),
        ("ES", "D", "step", {}),
        ("ES", "A", "episode", {"seed": 3, "alpha": 3e-8}),
        ("GES", "A", "step", {}),
        ("GES", "B", "episode", {}),
        ("GES", "D", "step", {"seed": 1}),
        ("GES", "E", "step", {}),
        ("TDC", "A", "step", {}),
        ("TDC", "C", "step", {}),
        ("TDC", "D", "episode", {"seed": 2}),
        ("QL", "A", "step", {"constrained": True}),
        ("QL", "D", "step", {"constrained": True}),
    )
]


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
    _, weights, explore = prepare(experiment, Persistent(nmpc))
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
                    product = there.hessian_times(state, theta, plan, old_w)
                    h = rules("curvature", delta, phi, old_w, product)
                    moved = rules("project", moved - alpha * h, *paper.THETA_SET)
                theta = moved
            thetas.append(theta)
            state = later
    return np.array(thetas)


@pytest.mark.parametrize("experiment", RUNS, ids=str)
def test_a_run_is_that_of_the_library(robot_module, experiment):
    """To 1e-9; TDC to 1e-8, because a product with the Hessian has fewer digits than a gradient."""
    expected = run(experiment).steps["theta"]
    found = learned(robot_module, experiment)
    assert found.shape == expected.shape
    digits = 1e-8 if experiment.learner == "TDC" else 1e-9
    assert np.abs(found - expected).max() < digits * np.abs(expected).max()
