"""From names to learners and networks: one registry each, which refuses what it does not know."""

from contextlib import contextmanager
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from nmpcrl.control import Nmpc, SolverError, differential_drive
from nmpcrl.learning import expected_sarsa
from nmpcrl.learning.rollout import Persistent
from nmpcrl.study import Experiment, ParameterError, paper, run, setup
from nmpcrl.study.learners import LEARNERS, NETWORKS, Entry
from nmpcrl.study.setup import controller_of, prepare, step_size


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
    learner = SimpleNamespace(bootstrap=None)
    entry = Entry(lambda _, __, rngs: (seen.append(rngs), learner)[1])
    monkeypatch.setitem(LEARNERS, "ES", entry)
    wanted = Experiment(episodes=1)
    prepare(wanted, controller_of(wanted))
    (rngs,) = seen
    children = np.random.SeedSequence(wanted.seed).spawn(3)
    assert rngs.network.normal() == np.random.default_rng(children[1]).normal()
    assert rngs.directions.normal() == np.random.default_rng(children[2]).normal()
    assert setup.Generators._fields == ("noise", "network", "directions")


@pytest.mark.parametrize("field", ["beta", "zeta", "network"])
def test_a_learner_that_reads_what_its_entry_does_not_name_is_refused(monkeypatch, field):
    entry = Entry(lambda e, nmpc, _: expected_sarsa(nmpc, float(bool(getattr(e, field)))))
    monkeypatch.setitem(LEARNERS, "new", entry)
    wanted = replace(Experiment(episodes=1), learner="ES")
    object.__setattr__(wanted, "learner", "new")
    message = f"learner = 'new' reads {field}: its entry in LEARNERS needs '{field}' in `reads`"
    with pytest.raises(ParameterError, match=message):
        prepare(wanted, controller_of(wanted))


def test_a_learner_that_holds_a_network_without_saying_so_is_refused(monkeypatch):
    monkeypatch.setitem(LEARNERS, "DES", replace(LEARNERS["DES"], network=False))
    wanted = Experiment("DES", episodes=1)
    with pytest.raises(ParameterError, match="holds a network: its entry in LEARNERS needs"):
        prepare(wanted, controller_of(wanted))


@pytest.mark.parametrize("name", LEARNERS)
def test_an_entry_names_fields_that_not_all_learners_read(name):
    optional = {one.name for one in fields(Experiment) if one.metadata["optional"]}
    assert set(LEARNERS[name].reads) <= optional


@pytest.mark.parametrize("name", LEARNERS)
def test_an_entry_says_how_many_solves_a_step_makes_and_whether_theta_moves(name):
    wanted = Experiment(name, episodes=2, steps=70)  # a network is fitted in the second
    steps = run(wanted).steps
    assert steps["solves"][-1] == LEARNERS[name].solves + wanted.values_actions
    assert (steps["theta"][-1] != steps["theta"][0]).any() == LEARNERS[name].moves


@pytest.mark.parametrize("name", LEARNERS)
def test_the_step_size_of_every_learner_of_the_book_is_alpha(name):
    moves = LEARNERS[name].moves
    assert step_size(Experiment(name, alpha=3e-7).canonical) == (3e-7 if moves else paper.ALPHA)
