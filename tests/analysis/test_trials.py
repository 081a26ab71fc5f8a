"""Runs outside the study: judged without noise, one row an evaluation, and nothing stored."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.trials import final_costs, summarise, trial
from nmpcrl.learning import (
    Exploration,
    Learner,
    SecondSolve,
    Weights,
    evaluate,
    expected_sarsa,
    frozen,
    train,
)
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
SHAPE = (3, 6, 2)


@pytest.fixture(scope="module")
def nmpc():
    return paper.nmpc()


def noise() -> Exploration:
    return Exploration.draw(np.random.default_rng(0), SHAPE)


def test_the_frozen_arm_costs_the_same_after_every_episode(nmpc):
    rows = trial(frozen(nmpc), nmpc, THETA, noise(), every=1)
    assert rows.episode.tolist() == [0, 1, 2, 3]
    assert rows.cost.tolist() == [evaluate(nmpc, THETA, SHAPE[1]).cost] * 4
    assert set(rows.learner) == {"frozen"}


def test_the_last_episode_is_judged_whatever_the_interval(nmpc):
    assert trial(frozen(nmpc), nmpc, THETA, noise(), every=2).episode.tolist() == [0, 2, 3]


def test_theta_moves_as_train_moves_it(nmpc):
    es = expected_sarsa(nmpc, 1e-7)
    rows = trial(es, nmpc, THETA, noise())
    *_, last = train(es, nmpc, Weights(THETA, np.full(9, paper.W_INIT)), noise())
    assert np.array_equal(rows.theta.iloc[-1], last.weights.theta)
    assert not np.array_equal(last.weights.theta, THETA)


@pytest.mark.parametrize("at", [1, SHAPE[1]])
def test_a_run_that_diverges_ends_in_an_infinite_cost(nmpc, at):
    steps = []

    def lost(weights, *_):
        steps.append(1)
        return Weights(weights.theta * (np.nan if len(steps) == at else 1), weights.w)

    rows = trial(Learner("lost", SecondSolve(nmpc), lost, 0.97), nmpc, THETA, noise(), every=1)
    assert rows.cost.iloc[-1] == np.inf
    assert rows.episode.iloc[-1] == SHAPE[0]
    assert np.isfinite(rows.cost.iloc[:-1]).all()


def rows_of(costs: dict[str, list[float]]) -> pd.DataFrame:
    return pd.DataFrame(
        [
            {"learner": name, "seed": seed, "episode": episode, "cost": cost + 5 - episode}
            for name, values in costs.items()
            for seed, cost in enumerate(values)
            for episode in (0, 5)
        ]
    )


def test_the_final_costs_are_the_last_of_each_run_in_the_order_of_the_learners():
    final = final_costs(rows_of({"mine": [3.0, 1.0], "ES": [4.0, 4.0]}))
    assert list(final) == ["mine", "ES"]
    assert final["mine"].tolist() == [3.0, 1.0]


def test_learners_are_compared_with_the_baseline():
    final = final_costs(rows_of({"mine": [3.0, 1.0, 2.0, 2.0], "ES": [4.0, 5.0, 6.0, 7.0]}))
    table = summarise(final, "ES")
    assert table.loc["mine", "interquartile mean"].value == 2.0
    assert table.loc["mine", "P(costs less)"].value == 1.0
    assert table.loc["ES", "P(costs less)"].value == 0.5
