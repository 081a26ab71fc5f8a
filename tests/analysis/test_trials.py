"""Runs of one's own, compared: one row an evaluation."""

from functools import partial

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.trials import evaluations, final_costs, summarise
from nmpcrl.learning import Learner, SecondSolve, UpdateRule, evaluate, frozen
from nmpcrl.study import Trial, paper, run

THETA = paper.THETA_INIT
EPISODES, STEPS = 3, 6
NMPC = paper.nmpc()


def rows(learner, make, **options):
    options = {"evaluate_every": 1, **options}
    one = Trial(learner, make, NMPC, THETA, episodes=EPISODES, steps=STEPS, **options)
    return evaluations([run(one)])


@pytest.mark.parametrize(("every", "judged"), [(1, [0, 1, 2, 3]), (2, [0, 2, 3])])
def test_a_frozen_theta_costs_the_same_whenever_it_is_judged_and_at_the_end(every, judged):
    found = rows("frozen", frozen, evaluate_every=every)
    assert found.episode.tolist() == judged
    assert {*found.cost} == {evaluate(NMPC, np.array(THETA), STEPS).cost}
    assert {*found.learner} == {"frozen"}


def lost(nmpc, at):
    steps = []

    def step(theta, memory, *_):
        steps.append(1)
        return theta * (np.nan if len(steps) == at else 1), memory

    return Learner("lost", SecondSolve(nmpc), UpdateRule(step), nmpc.gamma)


@pytest.mark.parametrize("at", [1, STEPS])
def test_a_run_that_diverges_ends_in_an_infinite_cost(at):
    found = rows("lost", partial(lost, at=at))
    assert found.cost.iloc[-1] == np.inf
    assert found.episode.iloc[-1] == EPISODES
    assert np.isfinite(found.cost.iloc[:-1]).all()


def test_learners_are_compared_with_the_baseline_by_the_last_cost_of_each_run():
    costs = {"mine": [3.0, 1.0, 2.0, 2.0], "ES": [4.0, 5.0, 6.0, 7.0]}
    columns = ["learner", "seed", "episode", "cost"]
    final = final_costs(pd.DataFrame(
        [(name, seed, episode, cost + 5 - episode) for name, values in costs.items()
         for seed, cost in enumerate(values) for episode in (0, 5)], columns=columns
    ))  # fmt: skip
    assert final.to_dict("list") == costs
    table = summarise(final, "ES")
    assert table.loc["mine", "interquartile mean"].value == 2.0
    assert table["P(costs less)"].map(lambda one: one.value).tolist() == [1.0, 0.5]
