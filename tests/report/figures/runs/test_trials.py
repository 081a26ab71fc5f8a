"""The figures of runs outside the study: their titles follow from what they are given."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims.verdict import NOT, REPRODUCED, Verdict
from nmpcrl.report.figures.runs import trials
from nmpcrl.study import paper


def title(figure) -> str:
    (axes,) = figure.axes
    return axes.get_title(loc="left") or axes.get_title()


def names(figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_learner_that_ends_lowest_is_named_and_each_has_one_entry():
    rows = pd.DataFrame(
        [
            {"learner": name, "seed": seed, "episode": episode, "cost": 9.0 - gain * episode}
            for name, gain in {"ES": 0.1, "mine": 0.5, "frozen": 0.0}.items()
            for seed in (0, 1)
            for episode in (0, 5)
        ]
    )
    figure = trials.costs(rows)
    assert title(figure) == "mine ends lowest: 6.5 (median)"
    assert names(figure) == ["ES", "mine", "frozen"]
    colors = {line.get_color() for line in figure.axes[0].get_lines()}
    assert len(colors) == 3


def test_the_infinite_cost_of_a_lost_run_is_not_drawn():
    rows = pd.DataFrame({"learner": "mine", "seed": 0, "episode": [0, 5], "cost": [7.0, np.inf]})
    (line,) = trials.costs(rows).axes[0].get_lines()
    assert np.isfinite(line.get_ydata()).tolist() == [True, False]


def test_the_trajectory_that_costs_least_is_named():
    there = {"states": np.zeros((4, 5)), "cost": 3.0}
    rollouts = {
        "before": SimpleNamespace(**there | {"cost": 12.4}),
        "after": SimpleNamespace(**there),
    }
    figure = trials.trajectories(paper.task(), rollouts)
    assert title(figure) == "Lowest cost: after, 3"
    assert names(figure) == ["before: 12.4", "after: 3"]


@pytest.mark.parametrize(("second", "said"), [(REPRODUCED, "2 of 2"), (NOT, "1 of 2")])
def test_the_title_counts_the_parts_that_say_yes(second, said):
    def verdict(outcome, share):
        interval = (max(0, share - 0.1), min(1, share + 0.1))
        return Verdict("P", "", outcome, "", "", share=share, interval=interval)

    figure = trials.shares({0.1: verdict(REPRODUCED, 1.0), 4: verdict(second, 0.05)}, "ratio")
    assert title(figure) == f"Taken by themselves, {said} are a yes"
    assert [tick.get_text() for tick in figure.axes[0].get_xticklabels()] == ["0.1", "4"]


def test_every_rollout_is_drawn_in_a_look_of_its_own_and_small_costs_keep_their_digits():
    rollouts = {
        name: SimpleNamespace(states=np.zeros((4, 5)), cost=cost)
        for name, cost in zip("abcde", (0.384, 1.5, 99.96, 1234.5, np.inf), strict=True)
    }
    figure = trials.trajectories(paper.task("A"), rollouts)
    assert names(figure) == ["a: 0.384", "b: 1.5", "c: 100", "d: 1234", "e: inf"]
    drawn = figure.axes[0].get_lines()[-5:]
    assert len({(line.get_color(), line.get_linestyle()) for line in drawn}) == 5
    assert title(figure) == "Lowest cost: a, 0.384"
