"""One run on one page, wide and narrow, and in words."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from legibility import flaws
from matplotlib import pyplot as plt

from nmpcrl.report.figures.runs.run import run_page
from nmpcrl.report.run import finding, verdict
from nmpcrl.study import Experiment, run
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.records import Records

SHORT = {"steps": 5, "evaluate_every": 1}
RUNS = {
    "ES": Experiment(episodes=3, **SHORT),
    "RDES": Experiment("RDES", episodes=3, **SHORT),
    "GES": Experiment("GES", episodes=3, **SHORT),
    "frozen": Experiment("frozen", episodes=3, **SHORT),
    "one episode": Experiment(episodes=1, **SHORT),
    "diverged": Experiment(episodes=3, alpha=1e-2, **SHORT),
    "other layout": Experiment(episodes=3, layout="B", **SHORT),
    "drawn": Experiment(episodes=3, layout=((0.5, 2.2), (3, 7)), target=(6, 8, 0), **SHORT),
}


@pytest.fixture(scope="module")
def known():
    return {name: run(experiment) for name, experiment in RUNS.items()}


def titles(figure) -> list[str]:
    return [axes.get_title(loc="left") for axes in figure.axes]


@pytest.fixture(scope="module")
def arms() -> Callable[[str], Records]:
    """The frozen arm of a run."""
    return cache(lambda name: run(frozen_arm(RUNS[name])))


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("with_arm", [False, True])
def test_every_run_has_a_page_whose_titles_state_what_is_seen(
    known, arms, name, with_arm, tmp_path
):
    figure = run_page(known[name], arms(name) if with_arm else None)
    assert figure.get_suptitle() == finding(known[name])
    for kind in ("svg", "png"):
        figure.savefig(tmp_path / f"page.{kind}")
        figure.set_layout_engine("none")  # what is laid out stays so
    assert len(figure.axes) == 5
    assert all(titles(figure))
    assert not plt.get_fignums()


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_any_run_can_be_read(known, arms, name):
    assert not flaws(run_page(known[name], arms(name)))


def test_steps_above_2_are_counted_in_the_title(known):
    records = known["ES"]
    alpha_phi2 = np.where(np.arange(15) < 4, 3.0, 0.5)
    figure = run_page(replace(records, steps=records.steps | {"alpha_phi2": alpha_phi2}))
    assert "4 of 15 steps above 2" in titles(figure)
    assert "None of 15 steps above 2" in titles(run_page(known["one episode"])) + titles(
        run_page(known["GES"])
    )


@pytest.mark.parametrize(
    ("factor", "said", "title"),
    [
        (
            0.9,
            "10.0% less than the 1000.0",
            "lowers the noise-free cost by 10.0%, from 1000 to 900",
        ),
        (1.1, "10.0% more than the 1000.0", "raises the noise-free cost by 10.0%"),
        (0.9999, "within 0.1% of the 1000.0 of theta_init", "within 0.1% of 1000"),
        (1.0, "within 0.1% of the 1000.0 of theta_init", "within 0.1% of 1000"),
    ],
)
def test_a_cost_that_did_not_change_has_not_changed_by_0_percent(known, factor, said, title):
    records = known["ES"]
    cost = np.append(1000.0, np.full(len(records.evaluations["cost"]) - 1, 1000.0 * factor))
    facts = records.facts | {"final_cost": 1000.0 * factor}
    changed = replace(records, evaluations=records.evaluations | {"cost": cost}, facts=facts)
    assert said in verdict(changed)
    assert title in finding(changed)
    assert "by 0.0%" not in finding(changed)
