"""Learners and networks by name: each reads what its entry says, and makes what its name says."""

from dataclasses import fields, replace

import numpy as np
import pytest

from nmpcrl.study import Experiment, paper, run
from nmpcrl.study.learners import DECAYS, LEARNERS, NETWORKS, Generators, readers
from nmpcrl.study.setup import job_of, prepare

CONTROLLER = paper.nmpc()
ALL = {one.name for one in fields(Experiment)}
OPTIONAL = {name for name in ALL if readers(name)}


class Recorder:
    """An experiment that records the fields that are read."""

    def __init__(self, experiment):
        self.experiment, self.read = experiment, set()

    def __getattr__(self, name):
        self.read.add(name)
        return getattr(self.experiment, name)


@pytest.mark.parametrize("name", LEARNERS)
def test_a_learner_is_what_its_entry_says_and_reads_only_what_its_entry_names(name):
    """A field that is read and not named would be missing from the keys of the runs."""
    entry, read = LEARNERS[name], set()
    for network in NETWORKS if entry.network else ("plain",):
        experiment = Recorder(Experiment(name, network=network, alpha=3e-7))
        learner = entry.make(
            experiment, CONTROLLER, Generators(*map(np.random.default_rng, range(3)))
        )
        assert learner.name == name
        assert hasattr(learner.bootstrap, "network") == entry.network
        if beta := {"GES": paper.BETA, "TDC": paper.BETA_TDC}.get(name):
            assert (learner.rule.step.alpha, learner.rule.step.beta) == (3e-7, beta)
        if entry.network:
            assert learner.bootstrap.fits == NETWORKS[network].fits
        read |= experiment.read & OPTIONAL
    wherever = {"constrained", "ties_active"}  # read by the experiment and its controller
    assert read <= set(entry.reads) <= read | wherever
    expected = paper.ALPHA if name == "frozen" else 3e-7
    assert job_of(Experiment(name, episodes=1, alpha=3e-7)).named.alpha == expected


@pytest.mark.parametrize("name", LEARNERS)
def test_a_step_makes_the_solves_of_its_entry_and_theta_moves_where_it_says(name):
    wanted = Experiment(name, episodes=2, steps=70)  # a network is fitted in the second
    steps = run(wanted).steps
    assert steps["solves"][-1] == LEARNERS[name].solves + wanted.values_actions
    assert (steps["theta"][-1] != steps["theta"][0]).any() == (name != "frozen")


def test_each_purpose_of_a_seed_has_a_generator_of_its_own(monkeypatch):
    seen = []
    entry = replace(LEARNERS["ES"], make=lambda *given: seen.extend(given[-1]))
    monkeypatch.setitem(LEARNERS, "ES", entry)
    _, weights, _ = prepare(Experiment(episodes=1, seed=5), CONTROLLER)
    assert (weights.w == paper.W_INIT).all()
    expected = map(np.random.default_rng, np.random.SeedSequence(5).spawn(3))
    drawn = [one.normal() for one in expected]
    assert [used.normal() for used in seen][1:] == drawn[1:]  # the noise was drawn before


@pytest.mark.parametrize(("name", "values"), [("learner", [*LEARNERS]), ("decay", [*DECAYS])])
def test_the_noise_of_a_seed_is_the_same_for_all_learners_and_readings(name, values):
    runs = [prepare(Experiment(**{name: one}, seed=3), CONTROLLER)[2] for one in values]
    for explore in runs:
        np.testing.assert_array_equal(explore.noise, runs[0].noise)


@pytest.mark.parametrize(("decay", "k"), [("step", np.arange(6)), ("episode", [0, 0, 0, 1, 1, 1])])
def test_noise_decays_per_step_or_per_episode_as_the_experiment_says(decay, k):
    explore = prepare(Experiment(decay=decay, decay_rate=0.9, episodes=2, steps=3), CONTROLLER)[2]
    np.testing.assert_allclose(explore.scale.ravel(), 0.9 ** np.array(k))
