"""From names to learners and networks: one registry each, which refuses what it does not know."""

from contextlib import contextmanager

import numpy as np
import pytest

from nmpcrl.control import Nmpc, SolverError, differential_drive
from nmpcrl.learning.rollout import Persistent
from nmpcrl.study import Experiment, ParameterError, paper, setup
from nmpcrl.study.setup import LEARNERS, NETWORKS, controller_of, prepare


@contextmanager
def without(registry, name):
    """Take a name out of a registry for a while; it comes back at its old place."""
    whole = dict(registry)
    del registry[name]
    try:
        yield
    finally:
        registry.clear()
        registry.update(whole)


@pytest.mark.parametrize("name", LEARNERS)
def test_every_learner_calls_itself_by_its_name_in_the_registry(name):
    wanted = Experiment(name, episodes=1)
    learner, _, _ = prepare(wanted, controller_of(wanted))
    assert learner.name == name


def test_a_learner_without_a_factory_is_refused_and_never_frozen():
    wanted = Experiment("matched", episodes=1)
    with without(LEARNERS, "matched"):
        with pytest.raises(KeyError, match="matched"):
            prepare(wanted, controller_of(wanted))
        with pytest.raises(ParameterError, match="learner = 'matched' must be one of"):
            Experiment("matched")


def test_a_network_that_is_not_in_the_registry_is_refused_and_never_plain():
    wanted = Experiment("DES", network="four fits", episodes=1)
    with without(NETWORKS, "four fits"):
        with pytest.raises(KeyError, match="four fits"):
            prepare(wanted, controller_of(wanted))
        with pytest.raises(ParameterError, match="network = 'four fits' must be one of"):
            Experiment("DES", network="four fits")


@pytest.mark.parametrize(("network", "fits"), [("plain", 1), ("four fits", 4), ("tanh", 1)])
def test_the_registry_says_how_often_a_network_is_fitted(network, fits):
    wanted = Experiment("RDES", network=network, episodes=1)
    learner, _, _ = prepare(wanted, controller_of(wanted))
    assert learner.bootstrap.fits == fits


class Unsolvable(Nmpc):
    def __init__(self):
        super().__init__(differential_drive(), paper.task())

    def solve(self, state, theta, warm_start=None, action=None):
        raise SolverError("no optimum", state, theta)


@pytest.mark.parametrize("learner", ["DES", "RDES"])
def test_only_a_normalised_network_asks_for_a_solve_before_training(learner):
    unsolvable = Persistent(Unsolvable())
    for network in NETWORKS:
        wanted = Experiment(learner, network=network, episodes=1)
        if network == "normalised":
            with pytest.raises(SolverError):
                prepare(wanted, unsolvable)
        else:
            prepare(wanted, unsolvable)


def test_the_purposes_of_a_seed_draw_from_generators_of_their_own(monkeypatch):
    seen = []
    monkeypatch.setitem(LEARNERS, "ES", lambda e, controller, rngs: seen.append(rngs))
    wanted = Experiment(episodes=1)
    prepare(wanted, controller_of(wanted))
    (rngs,) = seen
    children = np.random.SeedSequence(wanted.seed).spawn(3)
    assert rngs.network.normal() == np.random.default_rng(children[1]).normal()
    assert rngs.directions.normal() == np.random.default_rng(children[2]).normal()
    assert setup.Generators._fields == ("noise", "network", "directions")
