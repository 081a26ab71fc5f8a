"""The finding, against a second count by the geometry and the rollouts themselves."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims import published
from nmpcrl.claims.finding import finding
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import layouts, paper


@pytest.fixture(scope="module")
def found() -> pd.Series:
    return finding(published.load())


def runs(*learners: str) -> pd.DataFrame:
    main = published.load().main.runs
    return main[main.learner.isin(learners)].assign(
        saved=lambda r: 1 - r.final_cost / r.initial_cost
    )


def test_gaps_close_one_number_helps_and_runs_arrive_as_geometry_and_rollouts_say(found):
    mine, saved, lost, closed = runs("ES", "GES"), {}, [], 0
    for layout in paper.LAYOUTS:
        task, nmpc, theta = paper.task(layout), paper.nmpc(layout), np.array(paper.THETA_INIT)
        before = evaluate(nmpc, theta, paper.STEPS)
        last = mine.theta_8[mine.layout == layout]
        gaps = [layouts.gaps(task, before.states[:, :2], theta_c) for theta_c in last]
        closed += sum(min(widths.values()) <= 0 for widths in gaps)
        theta[-1] = task.margin
        after = evaluate(nmpc, theta, paper.STEPS)
        gain = 1 - after.cost / before.cost
        if task.distance(after.states[-1]) <= layouts.ARRIVED:
            saved[layout] = gain
        else:
            lost.append(-gain)
    assert (found.arrived_closed[1], found.arrived_open[1]) == (closed, len(mine) - closed)
    assert found.lost_by_hand == pytest.approx((min(lost), max(lost)))
    assert found.by_hand == (len(saved), len(paper.LAYOUTS))
    assert found.saved_by_hand == pytest.approx(np.median(list(saved.values())))
    beaten = [saved[one] > mine.saved[mine.layout == one].max() for one in saved]
    assert found.better == (sum(beaten), len(beaten))
    mine = runs("ES", "GES")
    good = (mine.ending == "arrived") & (mine.final_cost < mine.initial_cost)
    assert found.arrived_open[0] + found.arrived_closed[0] == good.sum()
    assert found.learned == pytest.approx(mine.saved[good].median())
    for learner, count in found.not_there.items():
        each = runs(learner)
        assert count == ((each.ending != "arrived").sum(), len(each))
        for factor, named in ((1, found.above), (1.01, found.worse)):
            bad = (each.final_cost > factor * each.initial_cost) | (each.stopped != "finished")
            assert named[learner] == (bad.sum(), len(each))


@pytest.mark.parametrize(
    ("decay", "stopped", "early"),
    [("episode", "stopped", "stopped_early"), ("step", "stopped_per_step", "early_per_step")],
)
def test_rdes_is_counted_in_each_reading_of_the_decay(found, decay, stopped, early):
    rdes = runs("RDES").query(f"decay == '{decay}'")
    ended = rdes[rdes.stopped != "finished"]
    assert getattr(found, stopped) == (len(ended), len(rdes))
    assert getattr(found, early) == (ended.steps_done / paper.STEPS <= 20).sum()
    assert getattr(found, early) < len(ended)


def test_without_published_runs_there_is_no_finding():
    assert finding(published.Published()).empty
