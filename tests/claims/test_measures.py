"""The numbers behind the claims say what the verdicts say, and what they would say elsewhere."""

from dataclasses import asdict, replace
from itertools import product

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims import paper_claims
from nmpcrl.claims.measures import MEASURES, Measure, achieved, at_borders, holds, steady
from nmpcrl.claims.rule import NOT, PARTLY, REPRODUCED, Verdict
from nmpcrl.study import Experiment
from nmpcrl.study.experiment import PAPER

SEEDS = range(5)


def drawn(seed: int) -> pd.DataFrame:
    """Runs of every learner with all that can go wrong, drawn."""
    rng = np.random.default_rng(seed)
    rows = []
    for learner, decay, number in product((*PAPER, "frozen"), ("step", "episode"), SEEDS):
        experiment = Experiment(learner, seed=number, decay=decay)
        inside = int(rng.random() < 0.3)
        rows.append(
            asdict(experiment)
            | {
                "theta": " ".join(map(repr, experiment.theta)),
                "stopped": rng.choice(["finished", "finished", "diverged: it went"]),
                "initial_cost": 1000.0,
                "final_cost": rng.choice([980.0, 991.0, 1000.0, 1100.0, np.inf]),
                "late_cost_range": rng.choice([0.01, 0.04, 0.06, np.inf]),
                "cost_ratio": rng.choice([0.9, 1.4, 1.6, np.inf]),
                "inputs": int(rng.random() < 0.1),
                "outside": 0,
                "distance": 0.1,
                "steps_done": 39_000,
                "worst_overlap": 0.1,
                "eval_worst_overlap": 0.05 if inside else -0.1,
                "imitation_with": rng.uniform(0.5, 1.1) if learner == "RDES" else np.nan,
                "imitation_without": 1.0,
                **{f"inside_{size}": 0 for size in paper_claims.SIZES},
                **{
                    f"eval_inside_{size}": inside * (size == "medium")
                    for size in paper_claims.SIZES
                },
                **{f"theta_{i}": value for i, value in enumerate(experiment.theta)},
            }
        )
    return pd.DataFrame(rows)


def drives(runs: pd.DataFrame, seed: int) -> dict[Experiment, np.ndarray]:
    """Drives that stand a drawn distance away from the start; some fail."""
    rng = np.random.default_rng(seed)
    away = rng.choice([0.0, 0.1, 0.3, np.nan], len(runs))
    named = map(paper_claims.experiment_of, runs.to_dict("records"))
    return {e: np.full((3, 3), x) for e, x in zip(named, away, strict=True)}


def asked(runs: pd.DataFrame, paths: dict) -> dict[str, tuple[pd.Series, Verdict]]:
    """What the measure answers, and the verdict, by claim."""
    verdicts = paper_claims.judge_runs(runs, paths)
    return {
        v.claim: (holds(MEASURES[v.claim], MEASURES[v.claim].of(runs, paths)), v) for v in verdicts
    }


@pytest.mark.parametrize("seed", range(8))
def test_every_measure_answers_as_the_claim_does(seed):
    runs = drawn(seed)
    for claim, (answers, verdict) in asked(runs, drives(runs, seed)).items():
        if claim != "C7":
            assert (int(answers.sum()), len(answers)) == verdict.counts["all"], claim


@pytest.mark.parametrize("seed", range(4))
def test_the_measure_of_c7_answers_its_weaker_question(seed):
    runs = drawn(seed)
    answers, _ = asked(runs, drives(runs, seed))["C7"]
    named = runs[runs.learner.isin(PAPER)]
    assert answers.sum() == ((named.eval_inside_medium == 0) & (named.inputs == 0)).sum()


@pytest.mark.parametrize("claim", MEASURES)
def test_a_run_that_is_missing_is_not_asked(claim):
    runs = drawn(0)
    kept = runs[(runs.seed > 0) | (runs.learner == "frozen")]
    before, after = (
        len(holds(MEASURES[claim], MEASURES[claim].of(some, drives(runs, 0))))
        for some in (runs, kept)
    )
    assert after == before * (len(SEEDS) - 1) / len(SEEDS)


GAINS = Measure("gain", 0.5, lambda *_: pd.DataFrame(), at_least=True)
LOSSES = Measure("loss", 0.5, lambda *_: pd.DataFrame())
CONTRAST = Measure("both", 0.5, lambda *_: pd.DataFrame(), contrast=True)
VALUES = pd.DataFrame({"one": np.linspace(0.1, 1.0, 10)})


def test_at_its_border_a_number_is_still_a_yes():
    values = pd.DataFrame({"one": [0.5]})
    assert holds(GAINS, values).all()
    assert holds(LOSSES, values).all()


def test_a_contrast_asks_the_first_arm_to_be_above_and_the_second_not():
    values = pd.DataFrame({"one": [0.6, 0.6, 0.5, np.nan], "other": [0.5, 0.6, 0.5, 0.5]})
    assert holds(CONTRAST, values).tolist() == [True, False, False]


def test_a_higher_border_is_harder_to_reach_and_easier_to_stay_below():
    borders = [0.05, 0.25, 0.55, 0.95, 1.05]
    gained, lost = (at_borders(one, VALUES, borders) for one in (GAINS, LOSSES))
    assert gained.share.tolist() == pytest.approx([1.0, 0.8, 0.5, 0.1, 0.0])
    assert lost.share.tolist() == pytest.approx([0.0, 0.2, 0.5, 0.9, 1.0])
    assert gained.outcome.tolist() == [REPRODUCED, PARTLY, PARTLY, NOT, NOT]
    assert ((gained.low <= gained.share) & (gained.share <= gained.high)).all()


def test_a_verdict_is_steady_if_a_border_half_and_twice_as_far_leave_it():
    assert steady(LOSSES, VALUES / 10)
    assert not steady(LOSSES, VALUES)
    ratios = replace(LOSSES, nothing=1.0)  # then 0.75 and 0 stand beside 0.5
    assert steady(ratios, VALUES + 1)
    assert not steady(ratios, 0.5 + VALUES / 5)


def test_of_nothing_known_nothing_is_said():
    nothing = pd.DataFrame({"one": [np.nan]})
    assert at_borders(GAINS, nothing, [0.1, 0.5]).empty
    assert steady(GAINS, nothing)


def test_the_share_achieved_is_1_at_what_is_possible_0_at_theta_init_and_negative_beyond():
    runs = pd.DataFrame(
        {
            "layout": ["A", "A", "A", "A", "A", "A", "B", "C"],
            "initial_cost": 100.0,
            "final_cost": [80.0, 100.0, 90.0, 120.0, np.inf, 90.0, 90.0, 90.0],
            "stopped": ["finished"] * 5 + ["diverged: it went"] + ["finished"] * 2,
        }
    )
    shares = achieved(runs, {"A": 0.2, "B": 0.0})
    worst = [-np.inf, -np.inf]
    np.testing.assert_allclose(shares, [1.0, 0.0, 0.5, -1.0, *worst, np.nan, np.nan], atol=1e-12)
