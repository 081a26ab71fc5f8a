"""What the chapter on a world that changes says of published runs."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.encounters import Contacts, Encounters
from nmpcrl.report import worlds
from nmpcrl.studies.worlds import ORACLES, VIEWS
from nmpcrl.study import paper
from nmpcrl.study.moving import still


def test_what_is_saved_is_a_share_of_the_same_layout_and_there_is_no_oracle_of_a_lag():
    costs = {f"{fault} {how}": cost for fault in (*ORACLES, "lag")
             for how, cost in {"init": 100.0, "oracle": 95.0, "ES": 95.0, "grid": 90.0}.items()
             if (fault, how) != ("lag", "oracle")}  # fmt: skip
    rows = [{"part": "model", "arm": arm, "place": place, "cost": cost * size}
            for arm, cost in costs.items() for place, size in (("J001", 1), ("J002", 2))
            if "grid" not in arm or place == "J001"]  # fmt: skip
    found = worlds.saved(pd.DataFrame(rows))
    assert [*found.index.unique(0)] == [*ORACLES, "lag"]  # noise has no rows
    assert found.oracle["lag"].isna().all()
    assert found.grid["speed"].dropna().to_dict() == pytest.approx({"J001": 0.1})
    assert found.ES["lag"].tolist() == pytest.approx([0.05, 0.05])


def test_how_deep_a_robot_is_inside_is_measured_from_the_edge_of_what_it_must_not_touch():
    states = np.zeros((paper.STEPS + 1, 3))
    one = Encounters(states, 0.0, Contacts(0, 0), arrived=False)
    assert worlds.deepest(one, still([(3.0, 0.0), (1.0, 0.0)])) == pytest.approx(0.25)
    assert worlds.deepest(one, still([(3.0, 0.0)])) == 0


def test_the_table_of_moving_obstacles_has_a_row_of_each_view_and_policy():
    runs = [
        {"part": "moving", "arm": f"{view} {policy}", "place": place, "k": k, "cost": cost,
         "arrived": True, "inside": k * (policy == "ES"), "seconds": 1.0}
        for view in VIEWS
        for policy, cost in zip(worlds.ENTRY, (100.0, 90.0, 95.0, 80.0), strict=True)
        for place in ("M01", "M02")
        for k in range(3 if policy == "ES" else 1)
    ]  # fmt: skip
    found = worlds.moving(pd.DataFrame(runs))
    of = found.loc[("extrapolated", "ES")]
    assert (of.cost.value, of.saved.value) == (pytest.approx(0.9), pytest.approx(0.1))
    assert (of.solved.value, of.clear.value, of.inside) == (1, 0, (2, 2))
    assert found.loc[("frozen", "init")].clear.value == 1
    assert worlds.moving_table(found).count("<tr>") == 1 + len(VIEWS) * len(worlds.ENTRY)
