"""Runs of one's own: named by all that they are made of, stored, and done in parallel."""

import pickle
from functools import partial

import casadi as ca
import numpy as np
import pytest
from builders import assert_same_numbers, raising

from nmpcrl.control import Ipopt, Nmpc, Problem
from nmpcrl.learning import Exploration, Weights, expected_sarsa, frozen, lstd_q, train
from nmpcrl.study import Experiment, ParameterError, Trial, fetch, fetch_all, paper, run, store
from nmpcrl.study.provenance import key

pytestmark = pytest.mark.usefixtures("runs")


def tank(horizon=3) -> Nmpc:
    """One state, two parameters, no task."""
    problem = Problem(
        states=1, inputs=1, horizon=horizon, gamma=0.9, theta={"gain": 0.5, "V0": 0.0},
        model=lambda x, u, th: 0.9 * x + th["gain"] * u,
        stage=lambda x, u, th: ca.sumsqr(x - 1) + 0.1 * ca.sumsqr(u),
        initial=lambda x, th: th["V0"], lower=-1, upper=1,
    )  # fmt: skip
    return Nmpc(problem, solver=Ipopt())


TANK = tank()


def filling(state, action, rng):
    later = 0.9 * state + 0.3 * action + rng.normal(scale=0.01, size=1)
    return later, float((state[0] - 1) ** 2), later[0] > 0.95


def anywhere(rng):
    return rng.uniform(0, 0.5, 1)


def trial(**options):
    given = {
        "learner": "LSTD-Q", "make": partial(lstd_q, alpha=0.5), "nmpc": TANK, "episodes": 2,
        "steps": 6, "plant": filling, "start": anywhere, "evaluate_every": 1,
    }  # fmt: skip
    return Trial(**given | options)


def test_a_trial_is_what_train_does_and_of_the_papers_robot_the_run_of_its_experiment():
    experiment = Experiment(episodes=2, steps=8, seed=3, evaluate_every=5)
    make = partial(expected_sarsa, alpha=paper.ALPHA)
    same = Trial("ES", make, paper.nmpc(), paper.THETA_INIT, seed=3, episodes=2, steps=8)
    one, other = run(experiment), run(same)
    assert_same_numbers(one, other, {"alpha_phi2"})
    records = run(trial())
    noise, _, world, _ = np.random.SeedSequence(0).spawn(4)
    explore = Exploration.draw(np.random.default_rng(noise), (2, 6, 1))
    steps = train(
        lstd_q(TANK, 0.5), TANK, Weights(TANK.problem.theta, np.zeros(2)), explore,
        constrained=True, plant=filling, start=anywhere, rng=np.random.default_rng(world),
    )  # fmt: skip
    np.testing.assert_array_equal(records.steps["theta"], [s.weights.theta for s in steps])


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 1},
        {"make": partial(lstd_q, alpha=0.4)},
        {"nmpc": tank(horizon=4)},
        {"plant": lambda state, action, rng: (state, 0.0, False)},
        {"start": (0.2,)},
        {"theta": (0.5, 0.1)},
        {"deviation": 0.5},
        {"steps": 7},
    ],
)
def test_every_field_of_a_trial_is_part_of_its_key(change):
    assert key(trial(**change)) != key(trial()) == key(trial())
    assert trial(**change) != trial() == pickle.loads(pickle.dumps(trial()))


def test_three_seeds_of_a_random_start_are_three_runs_which_are_stored(
    runs, trains_here, monkeypatch
):
    found = fetch_all([trial(seed=seed) for seed in range(3)], workers=1, progress=False)
    names = sorted(path.name.rpartition("-")[0] for path in (runs / "trials").iterdir())
    assert names == [f"LSTD_Q-seed{seed}-2ep" for seed in range(3)]
    monkeypatch.setattr(store, "run", raising(AssertionError("trained again")))
    assert_same_numbers(fetch(trial()), found[trial()])
    assert len({records.facts["final_cost"] for records in found.values()}) == 3
    assert [one.seed for one in found.select(seed=1)] == [1]


@pytest.mark.slow
def test_trials_of_a_notebook_are_done_in_other_processes(runs):
    """A cell's functions have no module that a worker could import."""
    cell = {"__name__": "__main__", "np": np, "lstd_q": lstd_q}
    exec(
        "leak = 0.8\n"
        "def plant(state, action, rng):\n"
        "    return leak * state + 0.3 * action, float(np.abs(state[0] - 1)), False\n"
        "def make(nmpc):\n"
        "    return lstd_q(nmpc, 0.5)\n",
        cell,
    )
    own = {"plant": cell["plant"], "make": cell["make"], "start": (0.0,)}
    trials = [trial(seed=seed, **own) for seed in range(2)]
    found = fetch_all([*trials, Experiment(episodes=1, steps=3)], workers=2, progress=False)
    assert len([*(runs / "trials").iterdir()]) == 2
    for one in trials:
        assert_same_numbers(found[one], run(one))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"episodes": 0}, "episodes = 0 must be a whole number from 1"),
        ({"make": frozen(TANK)}, "must be a function of nmpc"),
        ({"nmpc": paper.nmpc()}, "theta must be given where the Nmpc has a task and no Problem"),
        ({"plant": np.random.default_rng(0)}, "this trial cannot be stored: a Generator, .*"),
    ],
)
def test_what_makes_no_trial_is_refused(change, message):
    with pytest.raises(ParameterError, match=message):
        trial(**change)
