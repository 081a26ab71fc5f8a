"""The figure of SAC and TD3: the title says when they match, and each panel has both."""

import numpy as np
import pandas as pd

from nmpcrl.report.figures.verdicts.agents import AGENT_LOOKS, courses
from nmpcrl.studies.agents import Course

EPISODES = (25, 50, 100, 150, 200, 250, 300)


def made(agent, last, episodes=EPISODES, units=6):
    """A course that falls from three times theta_init's cost."""
    fall = np.geomspace(3, last, len(episodes))[:, None]
    shares = fall * np.linspace(0.95, 1.05, units)
    names = tuple(map(str, range(units)))
    known = pd.DataFrame(shares, episodes, names)
    return Course(agent, known, known > np.inf)


def test_the_title_says_from_when_on_the_median_matches_and_each_panel_has_both_agents():
    long = (*EPISODES[:4], 200, 300, 500, 750, 1000, 1250, 1600)
    panels = {
        "each of 6 layouts": [made("SAC", 1.05), made("TD3", 0.9)],
        "layout A, 4 seeds": [made("SAC", 0.98, units=4), made("TD3", 0.95, units=4)],
        "one agent for 120 layouts": [made("SAC", 1.2, long, 120), made("TD3", 1.1, long, 120)],
    }
    figure = courses(panels, {"each of 6 layouts": 0.92, "layout A, 4 seeds": 0.87})
    title = figure.get_suptitle()
    assert "SAC not by episode 300" in title
    assert "TD3 from 300 episodes on" in title
    assert [axes.get_title(loc="left") for axes in figure.axes] == [*panels]
    for axes in figure.axes:
        labels = [line.get_label() for line in axes.get_lines()]
        assert {*AGENT_LOOKS} <= {*labels}
        assert len(axes.collections) == len(AGENT_LOOKS)
    assert ["best search" in str([line.get_label() for line in axes.get_lines()])
            for axes in figure.axes] == [True, True, False]  # fmt: skip


def test_agents_that_are_alike_stand_together_in_the_title():
    title = courses({"layout A": [made("SAC", 1.05), made("TD3", 1.1)]}, {}).get_suptitle()
    assert title.endswith("SAC and TD3 not by episode 300")


def test_one_panel_alone_has_all_that_the_legend_needs_and_says_its_own_finding():
    figure = courses({"layout A, 4 seeds": [made("TD3", 0.9, units=4)]}, {})
    (axes,) = figure.axes
    assert "TD3 from 300 episodes on" in figure.get_suptitle()
    assert "SAC" not in figure.get_suptitle()
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        line.get_label() for line in axes.get_lines()
    ]
