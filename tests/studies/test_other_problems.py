"""Other people's problems: predictions follow from the rows, and rows are what the library does."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims.verdict import NOT, REPRODUCED
from nmpcrl.studies import other_problems as study
from nmpcrl.studies.other_problems import ARMS, OTHER_PROBLEMS, Runs


def decided(tests, informed, best, spread):
    """Which predictions come true of given costs of arms, references and one seed's spread."""
    references = pd.Series({"informed": informed, "best_policy": best})
    given = Runs(pd.DataFrame(tests), pd.DataFrame(), references, pd.DataFrame([spread]))
    answers = OTHER_PROBLEMS.judge(given).values()
    return "".join({REPRODUCED: "1", NOT: "0"}[one.outcome] for one in answers)


def test_a_prediction_fails_where_its_numbers_do():
    one = {"ipopt": 100.0, "ipopt, 1e-10": 104.0, "steps of fatrop": 12, "before": 104.0,
           "after": 50.0, "gap": [1e-10, 1e-3]}  # fmt: skip
    other = {"ipopt": 104.0, "ipopt, 1e-10": 104.1, "steps of fatrop": 100, "before": 50.0,
             "after": 51.0, "gap": [1e-10, 1e-5]}  # fmt: skip
    same = {arm: np.full(50, 0.1) for arm in ARMS}
    worse = same | {
        "LSTD-Q, every step": np.full(50, 0.3),
        "TDC": np.r_[[np.inf] * 3, same["ES"][3:]],
        "QL": np.full(50, 0.14),
    }
    assert decided(worse, 0.3, 0.02, one) == "11100" + "101111"
    assert decided(same, 0.05, 0.09, other) == "00011" + "010000"


@pytest.mark.slow
def test_published_runs_are_made_again(monkeypatch):
    """Their beginning, before differences between processors have grown."""
    if not all(map(OTHER_PROBLEMS.is_current, ("learners", "spread"))):
        pytest.skip("the published runs are of earlier epochs")
    found = study.runs(OTHER_PROBLEMS.table())
    known = found.courses[(found.courses.arm == "ES") & (found.courses.k == 0)].iloc[0]
    for name, short in (("STEPS", 100), ("PEER_STEPS", 3)):
        monkeypatch.setattr(study, name, short)
    again = study.learn(ARMS["ES"], "", 1, 0)
    assert again["costs"][0] == pytest.approx(known.costs[0], rel=0.05)
    assert study.spread(None, "", 1, 0)["gap"] == pytest.approx(found.spreads.gap[0][:3], rel=0.05)
