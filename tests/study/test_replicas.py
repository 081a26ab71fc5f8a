"""Perturbed replicas: what is moved, and how their distance is counted."""

import numpy as np
import pytest

from nmpcrl.analysis.summary import RunSummary, separation, summarise
from nmpcrl.report.figures.runs import perturbed
from nmpcrl.study import replicas
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.run import run

SHORT = {"episodes": 2, "seeds": [3], "layout": "A"}


def with_theta(*rows) -> RunSummary:
    nothing = np.empty((0, 0))
    return RunSummary({}, {"theta": np.array(rows, float)}, {}, nothing, nothing, {})


def test_a_replica_differs_from_its_run_in_the_twelfth_digit_of_theta_x():
    experiment = Experiment()
    replica = replicas.perturbed(experiment)
    moved = np.array(replica.theta) - experiment.theta
    assert moved[0] == pytest.approx(replicas.PERTURBATION, rel=1e-3)
    assert not moved[1:].any()
    assert replica.seed == experiment.seed


def test_every_learner_that_moves_has_a_replica_in_both_readings_of_the_decay():
    found = [(e.learner, e.decay) for e, _ in replicas.pairs(**SHORT)]
    moving = ("ES", "DES", "RDES", "GES")
    wanted = [(name, decay) for name in moving for decay in ("step", "episode")]
    assert sorted(found) == sorted(wanted)


def test_the_other_solver_gets_a_run_as_long_as_it_can_afford():
    for episodes, expected in ((300, replicas.SOLVER_EPISODES), (4, 4)):
        one, other = replicas.solver_pair(Experiment(episodes=episodes))
        assert (one.solver, other.solver) == ("riccati", "ipopt")
        assert one.episodes == other.episodes == expected


def test_separation_is_the_largest_difference_over_the_episodes_that_both_reached():
    one = with_theta([1, 2], [3, 4], [5, 6])
    other = with_theta([1, 2], [2.5, 4.25], [np.nan, np.nan])
    np.testing.assert_array_equal(separation(one, other), [0, 0.5])


@pytest.mark.slow
def test_a_run_learns_the_same_with_our_solver_as_with_ipopt():
    """Until rounding separates them; two episodes of a learner that settles are far from it."""
    one, other = (summarise(run(e)) for e in replicas.solver_pair(Experiment(episodes=2)))
    assert separation(one, other).max() < 1e-6


@pytest.mark.parametrize(("end", "title"), [(1e-13, "none end further apart"), (1e-2, "of DES")])
def test_the_figure_of_replicas_says_whose_difference_grew(end, title):
    experiment = Experiment(learner="DES", steps=5, episodes=2)
    apart = np.geomspace(1e-12, end, 10)
    figure = perturbed.replicas({experiment: apart}, np.full(10, 1e-10), replicas.PERTURBATION)
    assert title in figure.get_suptitle()
