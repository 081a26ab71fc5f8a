"""Other people's problems: what is published is whole, and predictions follow from numbers."""

import json
from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.analysis import other_problems, solver_spread, wrong_model
from nmpcrl.analysis.solver_spread import Spread, normalised_step
from nmpcrl.claims import published
from nmpcrl.learning import lstd_q
from nmpcrl.study.problems import gros_zanon as gz

PLACE = published.place() / other_problems.FILE


@pytest.fixture(scope="module")
def found():
    return other_problems.read(PLACE)


def test_every_arm_has_every_seed_and_every_prediction_is_decided(found):
    assert {(one.arm, one.seed) for one in found.courses} == {
        (arm, seed) for arm in wrong_model.ARMS for seed in range(wrong_model.SEEDS)
    }
    assert [one.seed for one in found.spreads] == list(range(solver_spread.SEEDS))
    said = {**wrong_model.PREDICTIONS, **solver_spread.PREDICTIONS}
    assert {name: sentence for name, (sentence, _) in found.predictions().items()} == said


def test_the_references_are_ordered_as_what_they_know(found):
    r = found.references
    assert r.best_policy <= r.best_theta < r.informed < r.wrong


def test_a_file_that_is_not_what_was_written_is_refused(tmp_path):
    content = json.loads(PLACE.read_text())
    content["references"]["informed"] = 0.001
    (tmp_path / "x.json").write_text(json.dumps(content))
    with pytest.raises(other_problems.DamagedProblems, match=r"not what was written.*--problems"):
        other_problems.read(tmp_path / "x.json")
    with pytest.raises(other_problems.DamagedProblems, match="missing or damaged"):
        other_problems.read(tmp_path / "none.json")


def test_what_is_kept_is_what_is_read(found, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    parts = [found.references, *found.spreads[:2], *found.courses[:3]]
    lost = replace(found.courses[0], test=np.inf, seed=99)
    kept = other_problems.kept([*parts, lost], 1.0)
    again = other_problems.read(other_problems.path())
    assert again.courses == kept.courses
    assert again.spreads == kept.spreads
    assert again.courses[-1].test == np.inf


def test_mpcrls_step_of_newton_is_a_normalised_semi_gradient():
    rng = np.random.default_rng(0)
    theta, phi = rng.normal(size=(2, 5))
    hessian = np.outer(phi, phi) + solver_spread.RIDGE * np.eye(5)
    expected = theta + 0.05 * 1.7 * np.linalg.solve(hessian, phi)
    np.testing.assert_allclose(normalised_step(theta, 1.7, phi), expected, rtol=1e-9)


def test_a_prediction_fails_where_its_numbers_do():
    one = Spread(0, {"ipopt": 100.0, "ipopt, 1e-10": 104.0, "fatrop": 9.0},
                 {"ipopt": 100, "ipopt, 1e-10": 100, "fatrop": 12}, 104.0, 103.0, 50.0,
                 (1e-10, 1e-3))  # fmt: skip
    assert solver_spread.held([one]) == {
        "single": True, "mean": False, "fatrop": True, "ours": True, "chaos": True, "order": True,
    }  # fmt: skip
    same = {arm: np.full(50, 0.1) for arm in wrong_model.ARMS}
    worse = same | {
        "LSTD-Q, every step": np.full(50, 0.3),
        "TDC": np.r_[[np.inf] * 3, same["ES"][3:]],
    }
    assert wrong_model.held(worse, informed=0.3, best=0.02) == {
        "informed": True, "every step": True, "optimum": True, "alike": True, "stable": False,
    }  # fmt: skip
    assert not wrong_model.held(same, informed=0.05, best=0.09)["informed"]
    assert not wrong_model.held(same, informed=0.05, best=0.09)["optimum"]


@pytest.mark.slow
def test_a_published_run_is_made_again_and_train_learns_as_mpcrl_does(found):
    """Of the first windows, before differences between processors have grown."""
    (known,) = (one for one in found.courses if (one.arm, one.seed) == ("ES", 0))
    again = wrong_model.run("ES", 0, 100)
    assert again.costs[0] == pytest.approx(known.costs[0], rel=0.05)
    nmpc, theta = wrong_model.controller(), gz.problem().theta
    assert lstd_q(nmpc, 0.05, every=1).name == "LSTD-Q"
    costs, path = solver_spread.q_learning(theta, np.full(3, -0.05))
    assert costs.shape == (3,)
    assert path.shape == (3, theta.size)
