"""A summary says of a run what its records say, and a table puts runs side by side."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from nmpcrl.analysis import metrics, rows
from nmpcrl.analysis.rows import experiment_of, row, table
from nmpcrl.analysis.summary import summarise
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import Experiment, paper, run
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.records import Records

SHORT = Experiment("RDES", episodes=4, steps=40, decay="episode", evaluate_every=2)


@pytest.fixture(scope="module")
def records():
    return run(SHORT)


@pytest.fixture(scope="module")
def short(records):
    return summarise(records)


def test_episodes_say_what_the_steps_say(records, short):
    steps, episodes = records.steps, short.episodes
    of = [steps["episode"] == k for k in range(4)]
    np.testing.assert_allclose(episodes["cost"], [steps["cost"][k].sum() for k in of])
    np.testing.assert_allclose(episodes["alpha_phi2"], [steps["alpha_phi2"][k].max() for k in of])
    np.testing.assert_allclose(episodes["iterations"], [steps["iterations"][k].mean() for k in of])
    np.testing.assert_array_equal(episodes["theta"], [steps["theta"][k][-1] for k in of])
    np.testing.assert_array_equal(episodes["steps"], [40] * 4)
    wrong = metrics.online_error(records)
    for name, column in (("delta", steps["delta"]), ("error", wrong)):
        expected = metrics.by_episode(records, column, metrics.root_mean_square)
        np.testing.assert_allclose(episodes[name], expected)
        assert np.isnan(expected[0])
        assert np.isfinite(expected[3])
    np.testing.assert_allclose(episodes["bias"], metrics.by_episode(records, wrong, np.mean))


@pytest.mark.parametrize(("episodes", "window"), [(300, 20), (40, 20), (39, 19), (2, 1), (1, 1)])
def test_the_end_of_training_is_its_last_20_episodes_or_its_second_half(short, episodes, window):
    """The median of 0, 1, ... over the window tells how long it is."""
    columns = {
        name: np.resize(column, (episodes, *column.shape[1:]))
        for name, column in short.episodes.items()
    } | dict.fromkeys(("cost", "bias", "error"), np.arange(float(episodes)))
    longer = replace(short, experiment=short.experiment | {"episodes": episodes}, episodes=columns)
    found = row(longer)
    for name in ("training_cost", "bias", "error"):
        assert found[name] == episodes - (window + 1) / 2


def test_every_state_in_an_obstacle_is_counted_by_how_far_it_is_in():
    """States at chosen overlaps of layout A's first obstacle, far from the others."""
    (x, y), xi = paper.LAYOUTS["A"][0], np.array([-0.1, 0.005, 0.05, 0.06, 0.5, 0.0])
    state = np.column_stack([np.full(6, x), y + 2.5 / 2 * np.sqrt(1 - xi), np.zeros(6)])
    experiment = replace(SHORT, learner="frozen", episodes=2, steps=3)
    steps = run(experiment).steps | {"state": state, "action": np.tile([0.7, 0.0], (6, 1))}
    steps |= {"alpha_phi2": np.array([0.1, OVERSHOOT, 9.0, 3.0, 2.5, 1.0])}
    evaluations = {
        "episode": np.array([0, 2]),
        "theta": np.ones((2, 9)),
        "cost": np.array([5.0, np.inf]),
        "states": np.array([state[:3], [*state[3:5], [np.nan] * 3]]),
        "actions": np.zeros((2, 3, 2)),
    }
    facts = {"stopped": "finished", "seconds": 1.0}
    found = summarise(Records(asdict(experiment), steps, evaluations, facts))
    np.testing.assert_array_equal(found.episodes["inside"], [[1, 1, 0], [0, 1, 1]])
    np.testing.assert_allclose(found.episodes["overlap"], [0.05, 0.5])
    np.testing.assert_array_equal(found.episodes["inputs"], [3, 3])
    np.testing.assert_array_equal(found.episodes["over"], [1, 2])
    np.testing.assert_array_equal(found.evaluations["inside"], [[1, 1, 0], [0, 1, 1]])
    assert np.isnan(found.evaluations["distance"][1])
    summary = row(found)
    assert (summary["inside_small"], summary["inside_medium"], summary["inside_large"]) == (1, 2, 1)
    assert summary["final_cost"] == np.inf
    assert summary["best_cost"] == 5.0


def test_what_was_never_reached_is_not_known():
    exploding = run(Experiment("ES", episodes=3, steps=6, alpha=1e5))
    found = summarise(exploding)
    assert found.facts["stopped"].startswith("diverged")
    assert np.isnan(found.episodes["cost"]).all()
    assert np.isnan(found.episodes["overlap"][1:]).all()
    assert row(found)["training_cost"] == np.inf
    assert row(found)["cut_short"] == 3
    np.testing.assert_array_equal(found.episodes["theta"][0], exploding.steps["theta"][-1])


def test_a_row_measures_as_the_metrics_do(records, short):
    found = row(short)
    for name in ("final_cost", "initial_cost", "late_cost_range"):
        assert found[name] == getattr(metrics, name)(records)
    theta = [found[f"theta_{i}"] for i in range(9)]
    np.testing.assert_array_equal(theta, records.steps["theta"][-1])
    assert (found["learner"], found["seed"]) == ("RDES", 0)


@pytest.mark.parametrize("lost", [slice(4, None), slice(3, None), slice(2, None)])
def test_the_table_and_the_metric_compare_a_run_with_its_frozen_learner(short, lost):
    arm = replace(short, experiment=asdict(frozen_arm(SHORT)))
    arm = replace(arm, episodes=arm.episodes | {"cost": 2 * short.episodes["cost"]})
    arm.episodes["cost"][lost] = np.nan
    ratios = table({SHORT: short, arm.name: arm}).set_index("learner").cost_ratio
    expected = metrics.cost_ratio(short.episodes["cost"], arm.episodes["cost"])
    assert ratios["RDES"] == expected == (0.5 if lost.start == 4 else 0)
    assert ratios["frozen"] == 1 or lost.start < 4
    assert np.isnan(table({SHORT: short}).cost_ratio[0])


def test_a_field_that_is_younger_than_a_run_has_what_all_runs_had_before(short, monkeypatch):
    """Today's default may be another one."""
    younger = {"start": "-1.0 1.0 0.0", "tolerance": 1e-6}
    for name, value in younger.items():
        monkeypatch.setitem(rows.OLDER, name, value)
    older = {name: value for name, value in short.experiment.items() if name not in younger}
    found = row(replace(short, experiment=older))
    assert {name: found.pop(name) for name in younger} == younger
    named = experiment_of(found)
    assert (named.start, named.tolerance) == ((-1.0, 1.0, 0.0), 1e-6)
