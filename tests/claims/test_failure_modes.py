"""Each mechanism is found in the runs that have it, and in no others."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from builders import summary_of

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims import thresholds
from nmpcrl.claims.failure_modes import OVER_PREDICTED, Mechanism, ending, mechanism, rise
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import Experiment, paper

RISING = (1000.0, 990.0, 1200.0, 1200.0, 1200.0)  # at episodes 0, 10, 20, 30, 40
WINDOW = slice(10, 20)  # in which that cost rose
AMONG = slice(14, 15)  # an episode in it
TASK = paper.task("A")
# Between the first two obstacles of layout A, whose centres are 3.02 m apart, then over the others.
THROUGH = np.array([[-2.5, 1.5], [1.0, 0.0], [2.5, 3.0], [5.5, 5.0], [8.5, 2.0]])
THROUGH = np.column_stack([THROUGH, [0, 0, 0, 0, np.pi / 2]])
AROUND = np.where(np.arange(15).reshape(5, 3) % 3 == 1, 8.0, THROUGH)
CLOSING = (np.hypot(2.5, 1.7) / 2.5) ** 2 - 1  # theta_c at which 2 * 1.25 sqrt(1 + theta_c) = 3.02
OTHER = "none of these"
BLAMED = OVER_PREDICTED * 30.0 / paper.GAMMA  # bias of a network beside the quiet TD error
SIGNS = {"alpha_phi2": 3.0, "bias": 100.0, "theta_c": 0.9, "failed": 1}  # of each mechanism


def made(cost=RISING, **columns) -> RunSummary:
    """A quiet run but for the given columns, as pairs (where, value)."""
    run = summary_of(Experiment("RDES", episodes=40, evaluate_every=10), states=THROUGH)
    judged = {name: column[: len(cost)] for name, column in run.evaluations.items()}
    episodes = {name: column.astype(float) for name, column in run.episodes.items()}
    for name, (where, value) in columns.items():
        column = episodes["theta"][:, -1] if name == "theta_c" else episodes[name]
        column[where] = value
    return replace(run, episodes=episodes, evaluations=judged | {"cost": np.array(cost)})


@pytest.mark.parametrize(
    ("run", "where"),
    [
        (made(), WINDOW),
        (made(cost=(1000.0, 1009.9, 900.0, np.inf, 900.0)), slice(20, 30)),
        (made(cost=(1000.0, 990.0), steps=(slice(17, None), 0)), slice(7, 17)),  # in no rollout
    ],
)
def test_the_cost_rose_between_the_last_good_rollout_and_the_first_bad_one(run, where):
    assert rise(run) == where


@pytest.mark.parametrize(
    ("columns", "name"),
    [
        ({}, OTHER),
        ({"alpha_phi2": (AMONG, OVERSHOOT + 1e-9)}, "overshoot"),
        ({"alpha_phi2": (AMONG, OVERSHOOT)}, OTHER),
        ({"theta_c": (AMONG, CLOSING + 1e-9)}, "gap"),
        ({"theta_c": (AMONG, CLOSING - 1e-9)}, OTHER),
        ({"bias": (WINDOW, BLAMED + 1e-9)}, "network"),
        ({"bias": (WINDOW, BLAMED - 1e-9)}, OTHER),
        ({"bias": (WINDOW, -2 * BLAMED)}, OTHER),  # it predicts too little
        ({"bias": (WINDOW, 100.0 * (-1.0) ** np.arange(10))}, OTHER),
        ({"failed": (slice(12, 17), 1)}, "solver"),  # half of the episodes
        ({"failed": (slice(12, 16), 1)}, OTHER),
        ({"cost": (1000.0, 990.0, np.inf, 1200.0, 1200.0)}, "solver"),
        *[({name: (slice(0, 10), value)}, OTHER) for name, value in SIGNS.items()],  # before
        *[({name: (slice(20, None), value)}, OTHER) for name, value in SIGNS.items()],  # and after
    ],
)
def test_a_mechanism_is_found_in_the_episodes_in_which_the_cost_rose(columns, name):
    assert mechanism(made(**columns), THROUGH) == name


def test_a_used_gap_closes_once_and_the_first_mechanism_in_order_counts():
    run = made(bias=(WINDOW, 30.0))
    run.episodes["bias"][AMONG] = run.episodes["delta"][AMONG] = np.nan
    assert mechanism(run, THROUGH) == "network"
    closed = made(theta_c=(slice(None), CLOSING + 0.1))
    assert mechanism(closed, AROUND) == OTHER
    assert mechanism(closed, THROUGH) == "gap"
    closed.experiment["theta"] = (*paper.THETA_INIT[:-1], CLOSING + 0.05)  # from the start
    assert mechanism(closed, THROUGH) == OTHER
    names = [*SIGNS]
    left = [{name: (WINDOW, SIGNS[name]) for name in names[i:]} for i in range(len(names) + 1)]
    assert tuple(mechanism(made(**columns), THROUGH) for columns in left) == (*Mechanism,)


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
def test_the_worst_ending_of_a_rollout_counts(change, name):
    states = THROUGH.copy()
    states[1:3] = [[0.0, 0.0, 0.0], [2.0, -1.5, 0.0]]  # clear of all obstacles
    for place, value in change.items():
        states[place] = value
    assert ending(states, TASK) == name


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
