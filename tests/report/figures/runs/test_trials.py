"""The figures of runs outside the study: their titles follow from what they are given."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims.verdict import NOT, REPRODUCED, Verdict
from nmpcrl.report.figures.runs import trials


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


@pytest.mark.parametrize(("second", "said"), [(REPRODUCED, "2 of 2"), (NOT, "1 of 2")])
def test_the_title_counts_the_parts_that_say_yes(second, said):
    def verdict(outcome, share):
        interval = (max(0, share - 0.1), min(1, share + 0.1))
        return Verdict("P", "", outcome, share=share, interval=interval)

    figure = trials.shares({0.1: verdict(REPRODUCED, 1.0), 4: verdict(second, 0.05)}, "ratio")
    assert title(figure) == f"Taken by themselves, {said} are a yes"
    assert [tick.get_text() for tick in figure.axes[0].get_xticklabels()] == ["0.1", "4"]


def test_the_title_says_how_much_of_the_gap_to_the_plant_is_closed():
    heights = {"before": np.array([1.0, -0.4]), "after": np.array([1.0, 0.0])}
    figure = trials.learned(np.array([1.0, 1.1, 1.2]), 1.4, heights, ("mass [kg]", "height [m]"))
    assert figure.get_suptitle() == "Learning closes 50% of the gap to the plant's mass"
    assert names(figure) == ["before", "after"]
