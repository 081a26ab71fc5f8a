"""What the chapter on a world that changes says of published runs."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.encounters import Contacts, Encounters
from nmpcrl.claims.investigation import Answer
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.report import worlds
from nmpcrl.studies.worlds import ORACLES, WORLD_QUESTIONS
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


def test_what_is_not_decided_is_not_listed():
    names = [one.name for one in WORLD_QUESTIONS]
    outcomes = (REPRODUCED, REPRODUCED, PARTLY, NOT, UNDECIDABLE)
    given = [Answer(outcome, {"layouts": (1, 2)}, question=name)
             for name, outcome in zip(names, outcomes, strict=False)]  # fmt: skip
    of_another_chapter = Answer(REPRODUCED, {"layouts": (1, 2)}, question="full terminal cost")
    said = worlds.decided([*given, of_another_chapter])
    assert said == dict(zip(("asked", "confirmed", "partly", "contradicted"), "5211", strict=True))
    assert [line[:2] for line in worlds.answered(given).splitlines()] == ["- "] * 4


def test_how_deep_a_robot_is_inside_is_measured_from_the_edge_of_what_it_must_not_touch():
    states = np.zeros((paper.STEPS + 1, 3))
    one = Encounters(states, 0.0, Contacts(0, 0), arrived=False)
    assert worlds.deepest(one, still([(3.0, 0.0), (1.0, 0.0)])) == pytest.approx(0.25)
    assert worlds.deepest(one, still([(3.0, 0.0)])) == 0


def test_the_suites_table_has_a_row_of_each_view_and_policy_that_is_published():
    runs = [
        {"part": "moving", "arm": f"extrapolated {policy}", "place": place, "k": k, "cost": cost,
         "arrived": True, "inside": k * (policy == "ES"), "seconds": 1.0}
        for policy, cost in (("init", 100.0), ("ES", 90.0))
        for place in ("M01", "M02")
        for k in range(1 if policy == "init" else 2)
    ]  # fmt: skip
    table = pd.DataFrame(runs)
    found = worlds.suite_rows(table)
    assert [*found] == [("extrapolated", "init"), ("extrapolated", "ES")]
    row = found["extrapolated", "ES"]
    assert (row.entry, row.places, row.solved.value, row.clear.value) == ("ES", 2, 1.0, 0.0)
    assert row.gain.value == pytest.approx(0.1)
    assert found["extrapolated", "init"].clear.value == 1.0
    assert worlds.suite_table(table).count("<tr>") == 3
