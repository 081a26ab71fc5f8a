"""The finding: runs are sorted by the theta_c that they end with, and by nothing that followed."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims import finding, published
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import layouts, paper


@pytest.fixture(scope="module")
def found() -> finding.Finding:
    return finding.finding(published.load())


def runs(*learners: str) -> pd.DataFrame:
    main = published.load().main
    return main[main.learner.isin(learners)]


def test_a_gap_is_closed_by_the_last_theta_c_as_the_geometry_says(found):
    closed = 0
    mine = runs("ES", "GES")
    for layout, group in mine.groupby("layout"):
        theta = np.array(paper.THETA_INIT)
        path = evaluate(paper.nmpc(layout), theta, paper.STEPS).states[:, :2]
        task = paper.task(layout)
        closed += sum(min(layouts.gaps(task, path, c).values()) <= 0 for c in group.theta_8)
    assert found.arrived_closed[1] == closed
    assert found.arrived_open[1] == len(mine) - closed


def test_arrived_are_those_whose_last_rollout_ends_at_the_target_and_costs_less(found):
    mine = runs("ES", "GES")
    good = (mine.ending == "arrived") & (mine.final_cost < mine.initial_cost)
    assert found.arrived_open[0] + found.arrived_closed[0] == good.sum()
    saved = 1 - mine.final_cost / mine.initial_cost
    assert found.learned == pytest.approx(saved[good].median())


def test_one_number_by_hand_is_a_rollout_with_the_margin(found):
    saved, lost = {}, []
    for layout in paper.LAYOUTS:
        task, nmpc = paper.task(layout), paper.nmpc(layout)
        theta = np.array(paper.THETA_INIT)
        before = evaluate(nmpc, theta, paper.STEPS)
        theta[-1] = task.margin
        after = evaluate(nmpc, theta, paper.STEPS)
        if task.distance(after.states[-1]) <= layouts.ARRIVED:
            saved[layout] = 1 - after.cost / before.cost
        else:
            lost.append(after.cost / before.cost - 1)
    assert found.lost_by_hand == pytest.approx((min(lost), max(lost)))
    assert found.by_hand == (len(saved), len(paper.LAYOUTS))
    assert found.saved_by_hand == pytest.approx(np.median(list(saved.values())))
    best = runs("ES", "GES").assign(saved=lambda r: 1 - r.final_cost / r.initial_cost)
    beaten = [saved[one] > best[best.layout == one].saved.max() for one in saved]
    assert found.better == (sum(beaten), len(beaten))


@pytest.mark.parametrize(
    ("decay", "stopped", "early"),
    [("episode", "stopped", "stopped_early"), ("step", "stopped_per_step", "early_per_step")],
)
def test_rdes_is_counted_in_each_reading_of_the_decay(found, decay, stopped, early):
    rdes = runs("RDES").query(f"decay == '{decay}'")
    ended = rdes[rdes.stopped != "finished"]
    assert getattr(found, stopped) == (len(ended), len(rdes))
    assert getattr(found, early) == (ended.steps_done / paper.STEPS <= 20).sum()
    assert 0 < getattr(found, early) < len(ended)


def test_runs_that_are_not_at_the_target_are_counted_by_learner(found):
    for learner, count in found.not_there.items():
        mine = runs(learner)
        assert count == ((mine.ending != "arrived").sum(), len(mine))
        for factor, named in ((1, found.above), (1.01, found.worse)):
            bad = (mine.final_cost > factor * mine.initial_cost) | (mine.stopped != "finished")
            assert named[learner] == (bad.sum(), len(mine))


def test_without_anything_published_there_is_no_finding():
    assert finding.finding(replace(published.load(), rows={})) is None
