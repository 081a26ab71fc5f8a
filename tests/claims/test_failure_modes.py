"""Each mechanism is found where it was put, and nothing is found where nothing was."""

from dataclasses import asdict

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims import thresholds
from nmpcrl.claims.failure_modes import (
    MECHANISMS,
    OVER_PREDICTED,
    WELL,
    ending,
    failure_modes,
    mechanism,
    rise,
)
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import Experiment, paper
from nmpcrl.study.experiment import frozen_arm

EPISODES, EVERY, START_COST = 40, 10, 1000.0
RISING = (1000.0, 990.0, 1200.0, 1200.0, 1200.0)  # at episodes 0, 10, 20, 30, 40
WINDOW = slice(10, 20)  # in which that cost rose
AMONG = slice(14, 15)  # an episode in it
TASK = paper.task("A")
# Between the first two obstacles of layout A, whose centres are 3.02 m apart, then over the others.
THROUGH = np.array([[-2.5, 1.5], [1.0, 0.0], [2.5, 3.0], [5.5, 5.0], [8.5, 2.0]])
THROUGH = np.column_stack([THROUGH, [0, 0, 0, 0, np.pi / 2]])
CLOSING = (np.hypot(2.5, 1.7) / 2.5) ** 2 - 1  # theta_c at which 2 * 1.25 sqrt(1 + theta_c) = 3.02


def made(learner="RDES", cost=RISING, states=THROUGH, stopped="finished", seed=0, **columns):
    """A run in which nothing stands out but the columns given, as pairs (where, value)."""
    experiment = Experiment(learner, seed=seed, episodes=EPISODES, evaluate_every=EVERY)
    quiet = {
        "cost": 100.0,
        "steps": 130,
        "failed": 0,
        "restarts": 0,
        "overlap": -0.1,
        "outside": 0,
        "inputs": 0,
        "alpha_phi2": 0.4,
        "over": 0,
        "delta": 30.0,
        "loss": 1.0,
        "bias": 0.0,
        "error": 10.0,
        "iterations": 5.0,
        "seconds": 0.01,
    }
    episodes = {name: np.full(EPISODES, value) for name, value in quiet.items()}
    episodes["theta"] = np.tile(paper.THETA_INIT, (EPISODES, 1))
    episodes["w"] = np.full((EPISODES, 9), paper.W_INIT)
    episodes["inside"] = np.zeros((EPISODES, 3), int)
    for name, (where, value) in columns.items():
        if name == "theta_c":
            episodes["theta"][where, -1] = value
        else:
            episodes[name][where] = value
    count = len(cost)
    evaluations = {
        "episode": EVERY * np.arange(count),
        "theta": np.tile(paper.THETA_INIT, (count, 1)),
        "cost": np.array(cost),
        "inside": np.zeros((count, 3), int),
        "overlap": np.full(count, -0.1),
        "distance": np.zeros(count),
    }
    facts = {"stopped": stopped, "seconds": 1.0}
    return RunSummary(asdict(experiment), episodes, evaluations, states, np.zeros((5, 2)), facts)


def found(run: RunSummary) -> str:
    return mechanism(run, TASK, THROUGH)


def frozen(seed=0) -> RunSummary:
    return made("frozen", (START_COST,) * 5, seed=seed)


# When the cost rose


def test_the_cost_rose_between_the_last_good_rollout_and_the_first_bad_one():
    assert rise(made()) == WINDOW
    assert rise(made(cost=(1000.0, 1009.9, 900.0, np.inf, 900.0))) == slice(20, 30)


def test_a_cost_that_no_rollout_saw_rise_rose_in_the_last_episodes_that_were_reached():
    stopped = {"cost": (1000.0, 990.0), "stopped": "diverged", "steps": (slice(17, None), 0)}
    assert rise(made(**stopped)) == slice(7, 17)


# The mechanisms


def test_a_run_with_nothing_that_stands_out_is_none_of_these():
    assert found(made()) == "none of these"


@pytest.mark.parametrize(
    ("column", "value", "name"),
    [
        ("alpha_phi2", OVERSHOOT + 1e-9, "overshoot"),
        ("alpha_phi2", OVERSHOOT, "none of these"),
        ("theta_c", CLOSING + 1e-9, "gap"),
        ("theta_c", CLOSING - 1e-9, "none of these"),
    ],
)
def test_one_episode_is_enough_for_an_overshoot_and_for_a_gap(column, value, name):
    assert found(made(**{column: (AMONG, value)})) == name


@pytest.mark.parametrize(
    ("share", "name"),
    [(OVER_PREDICTED + 1e-9, "network"), (OVER_PREDICTED - 1e-9, "none of these")],
)
def test_a_network_is_to_blame_for_its_share_of_the_error(share, name):
    bias = share * 30.0 / paper.GAMMA
    assert found(made(bias=(WINDOW, bias))) == name
    assert found(made(bias=(WINDOW, -bias))) == "none of these"  # it says too little


def test_a_network_that_says_too_much_and_too_little_in_turn_is_not_to_blame():
    assert found(made(bias=(WINDOW, 100.0 * (-1.0) ** np.arange(10)))) == "none of these"


def test_episodes_without_a_prediction_do_not_count():
    run = made(bias=(WINDOW, 30.0))
    run.episodes["bias"][AMONG] = run.episodes["delta"][AMONG] = np.nan
    assert found(run) == "network"


def test_a_gap_that_the_first_rollout_did_not_use_may_close():
    around = THROUGH.copy()
    around[1:4, 1] = 8.0
    assert mechanism(made(theta_c=(AMONG, CLOSING + 0.1)), TASK, around) == "none of these"


def test_a_gap_that_was_closed_from_the_start_did_not_close():
    run = made(theta_c=(slice(None), CLOSING + 0.1))
    run.experiment["theta"] = (*paper.THETA_INIT[:-1], CLOSING + 0.05)
    assert found(run) == "none of these"


@pytest.mark.parametrize(("episodes", "name"), [(5, "solver"), (4, "none of these")])
def test_the_solver_is_to_blame_where_it_cut_half_of_the_episodes_short(episodes, name):
    assert found(made(failed=(slice(12, 12 + episodes), 1))) == name


def test_the_solver_is_to_blame_where_the_rollout_itself_failed():
    assert found(made(cost=(1000.0, 990.0, np.inf, 1200.0, 1200.0))) == "solver"


@pytest.mark.parametrize(
    "columns",
    [{"alpha_phi2": 3.0}, {"bias": 100.0}, {"theta_c": 0.9}, {"failed": 1}],
    ids=MECHANISMS[:-1],
)
@pytest.mark.parametrize("where", [slice(0, 10), slice(20, None)])
def test_what_happened_before_or_after_the_cost_rose_is_no_reason_for_it(columns, where):
    assert found(made(**{name: (where, value) for name, value in columns.items()})) == (
        "none of these"
    )


def test_the_first_mechanism_in_order_is_the_one():
    signs = {"alpha_phi2": 3.0, "bias": 100.0, "theta_c": 0.9, "failed": 1}
    names = []
    while True:
        names.append(found(made(**{name: (WINDOW, value) for name, value in signs.items()})))
        if not signs:
            break
        signs.pop(next(iter(signs)))
    assert tuple(names) == MECHANISMS


# The endings


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({}, "arrived"),
        ({(-1, 0): 8.1, (-1, 1): 1.6}, "stuck"),
        ({(1, 1): -3.1}, "left the box"),
        ({(1, 0): 0.5, (1, 1): 2.2}, "hit"),
        ({(1, 1): -3.1, (2, 0): 0.5, (2, 1): 2.2}, "hit"),
        ({(-1, 0): np.nan}, "failed"),
    ],
)
def test_a_rollout_ended_as_the_worst_that_can_be_said_of_it(change, name):
    states = THROUGH.copy()
    states[1:3] = [[0.0, 0.0, 0.0], [2.0, -1.5, 0.0]]  # clear of all obstacles
    for place, value in change.items():
        states[place] = value
    assert ending(states, TASK) == name


# All runs


def test_every_run_that_learned_has_a_row_and_those_that_went_wrong_a_mechanism():
    runs = [
        made(seed=0, alpha_phi2=(WINDOW, 3.0)),
        made(seed=1, cost=(START_COST,) * 5),
        made(seed=2, cost=(START_COST,) * 5, states=np.full(THROUGH.shape, np.nan)),
        made(
            "GES", seed=0, cost=(START_COST,) * 5, stopped="diverged: w", failed=(slice(30, 40), 1)
        ),
        made("DES", seed=1, cost=(START_COST, *[1010.0] * 4)),
        made("DES", seed=2, cost=(START_COST, *[1010.1] * 4)),
    ]
    runs[1].episodes["cost"][20:] = 150.1
    frame = failure_modes([*runs, *(frozen(seed) for seed in range(3))])
    assert frame.learner.tolist() == ["RDES", "RDES", "RDES", "GES", "DES", "DES"]
    assert frame.wrong.tolist() == [
        "without noise",
        "training",
        "",
        "stopped",
        "",
        "without noise",
    ]
    assert frame.mechanism.tolist() == [
        "overshoot",
        "none of these",
        WELL,
        "solver",
        WELL,
        "none of these",
    ]
    assert frame.cost[0] == 1.2
    assert frame.episode.isna().tolist() == [wrong == "" for wrong in frame.wrong]
    assert frame.episode[0] == 10


def test_a_run_without_its_frozen_arm_is_refused():
    run = made()
    with pytest.raises(KeyError) as error:
        failure_modes([run])
    assert error.value.args == (frozen_arm(run.name),)


# Final cost beside theta_init's 100, and whether the run improves, worsens and solves.
@pytest.mark.parametrize(
    ("stopped", "cost", "distance", "expected"),
    [
        ("finished", 99.0, 0.0, (True, False, True)),
        ("finished", 99.5, 0.0, (False, False, True)),
        ("finished", 99.0, 1.0, (True, False, False)),
        ("finished", 100.0, 0.5, (False, False, True)),
        ("finished", 101.0, 0.0, (False, False, False)),
        ("finished", 101.1, 0.0, (False, True, False)),
        ("finished", np.inf, np.nan, (False, True, False)),
        ("no optimum", 90.0, 0.0, (False, True, False)),
    ],
)
def test_a_run_improves_stays_or_worsens_and_solves(stopped, cost, distance, expected):
    numbers = {"initial_cost": 100.0, "final_cost": cost, "distance": distance}
    runs = pd.DataFrame([{"stopped": stopped} | numbers])
    judged = (thresholds.improves, thresholds.worsens, thresholds.solved)
    assert tuple(bool(one(runs).item()) for one in judged) == expected
