"""Other people's problems: predictions follow from the rows, and rows are what the library does."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims.verdict import NOT, REPRODUCED
from nmpcrl.learning import lstd_q
from nmpcrl.studies import other_problems as study
from nmpcrl.studies.other_problems import ARMS, OTHER_PROBLEMS, Runs, normalised_step
from nmpcrl.study.problems import gros_zanon as gz


def test_the_references_are_ordered_as_what_they_know():
    known = study.runs(OTHER_PROBLEMS.table()).references
    assert known.best_policy <= known.best_theta < known.informed < known.wrong


def test_mpcrls_step_of_newton_is_a_normalised_semi_gradient():
    rng = np.random.default_rng(0)
    theta, phi = rng.normal(size=(2, 5))
    hessian = np.outer(phi, phi) + study.RIDGE * np.eye(5)
    expected = theta + 0.05 * 1.7 * np.linalg.solve(hessian, phi)
    np.testing.assert_allclose(normalised_step(theta, 1.7, phi), expected, rtol=1e-9)


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
def test_a_published_run_is_made_again_and_ours_learns_as_mpcrl_does():
    """Of the first windows, before differences between processors have grown."""
    courses = study.runs(OTHER_PROBLEMS.table()).courses
    known = courses[(courses.arm == "ES") & (courses.k == 0)].iloc[0]
    again = study.learn(ARMS["ES"], "", 1, 0, steps=100)
    assert again["costs"][0] == pytest.approx(known.costs[0], rel=0.05)
    nmpc, theta = study.controller(), gz.problem().theta
    assert lstd_q(nmpc, 0.05, every=1).name == "LSTD-Q"
    cost, path = study.q_learn(theta, np.full(3, -0.05))
    assert cost > 0
    assert path.shape == (3, theta.size)
