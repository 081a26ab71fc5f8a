"""The paper in one file trains as the library does, to the tolerance of its solver."""

from pathlib import Path

import numpy as np
import pytest
import torch

from nmpcrl.study import Experiment, run
from nmpcrl.study.setup import job_of

FILE = Path(__file__).parents[2] / "book" / "one_file.py"


def drawn_by(network):
    """The mini-batches that a network of the library draws."""

    def minibatch(count):
        while len(network) < count:
            network.remember(np.zeros(14), 0.0)
        network.fit()
        return torch.from_numpy(network.net[2][: len(network)].astype(int))[:128]

    return minibatch


@pytest.mark.slow
@pytest.mark.parametrize("learner", ["ES", "RDES", "GES"])
def test_two_episodes_are_those_of_the_library(monkeypatch, learner):
    """Costs to 1e-6 of them, and theta to 1e-6 where its steps are up to 0.4."""
    import one_file

    experiment = Experiment(learner=learner, episodes=2)
    if learner == "RDES":
        network = job_of(experiment).learner.bootstrap.network
        monkeypatch.setattr(one_file, "minibatch", drawn_by(network))
    steps = run(experiment).steps
    for number, (cost, theta) in enumerate(one_file.train(learner, 2)):
        within = steps["episode"] == number
        assert cost == pytest.approx(steps["cost"][within].sum(), rel=1e-6)
        np.testing.assert_allclose(theta, steps["theta"][within][-1], rtol=0, atol=1e-6)


def test_it_is_short_and_without_the_library():
    lines = FILE.read_text("utf-8").splitlines()
    assert len(lines) <= 150
    assert not any("nmpcrl" in line for line in lines if "import" in line)
