"""Claims that runs decide: their answers, their verdicts, and what other borders would give."""

from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
import pytest
from quiet_rows import quiet_row

from nmpcrl.analysis.rows import experiment_of
from nmpcrl.claims import paper_claims, thresholds
from nmpcrl.claims.by_runs import AtLeast, AtMost, Contrast
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.rule import Observations, arms
from nmpcrl.claims.thresholds import share_of_possible
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED
from nmpcrl.claims.wider_claims import WIDER_CLAIMS
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
        columns = {
            "stopped": rng.choice(["finished", "finished", "diverged: it went"]),
            "final_cost": rng.choice([980.0, 991.0, 1000.0, 1100.0, np.inf]),
            "late_cost_range": rng.choice([0.01, 0.04, 0.06, np.inf]),
            "cost_ratio": rng.choice([0.9, 1.4, 1.6, np.inf]),
            "inputs": int(rng.random() < 0.1),
            "eval_worst_overlap": 0.05 if inside else -0.1,
            "eval_inside_medium": inside,
            "imitation_with": rng.uniform(0.5, 1.1) if learner == "RDES" else np.nan,
        }
        rows.append(quiet_row(experiment, **columns))
    return pd.DataFrame(rows)


def rollouts(runs: pd.DataFrame, seed: int) -> dict[Experiment, np.ndarray]:
    """Rollouts that stand a drawn distance away from the start; some fail."""
    rng = np.random.default_rng(seed)
    away = rng.choice([0.0, 0.1, 0.3, np.nan], len(runs))
    named = map(experiment_of, runs.to_dict("records"))
    return {e: np.full((3, 3), x) for e, x in zip(named, away, strict=True)}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("claim", BY_RUNS.values(), ids=list(BY_RUNS))
def test_a_verdict_counts_the_answers_that_are_known(claim, seed):
    runs = drawn(seed)
    paths = rollouts(runs, seed)
    yes, of = claim.judge(Observations(runs, paths)).counts["all"]
    answers = claim.answers(claim.measure(runs, paths))
    assert of == len(answers)
    assert yes == answers.sum() or (claim.besides and yes < answers.sum())


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("claim", [BY_RUNS["C7"], WIDER_CLAIMS["W7"]], ids=["C7", "W7"])
def test_the_measure_of_c7_answers_its_weaker_question(claim, seed):
    runs = drawn(seed)
    answers = claim.answers(claim.measure(runs, rollouts(runs, seed)))
    named = runs[runs.learner.isin(claim.learners)]
    assert answers.sum() == ((named.eval_inside_medium == 0) & (named.inputs == 0)).sum()


def test_c1_and_c2_ask_what_divergence_and_instability_say_of_each_run():
    runs = drawn(0)
    for name, judged in (("C1", thresholds.divergence), ("C2", thresholds.instability)):
        one, other = (judged(arm) for arm in arms(runs, *BY_RUNS[name].learners))
        expected = (one & ~other).dropna()
        answers = BY_RUNS[name].answers(BY_RUNS[name].measure(runs, {}))
        assert answers.tolist() == expected.tolist()


@pytest.mark.parametrize("seed", range(2))
def test_c5_is_asked_of_both_distances_at_once(seed):
    runs, c5 = drawn(seed), BY_RUNS["C5"]
    paths = rollouts(runs, seed)
    apart = paper_claims.policy_distances(runs, paths)
    near = (apart.path <= thresholds.SAME_PATH) & (apart.cost <= thresholds.SAME_COST)
    assert c5.answers(c5.measure(runs, paths)).tolist() == (near & ~apart.failed).tolist()


@pytest.mark.parametrize("claim", BY_RUNS.values(), ids=list(BY_RUNS))
def test_a_run_that_is_missing_is_not_asked(claim):
    runs = drawn(0)
    kept = runs[(runs.seed > 0) | (runs.learner == "frozen")]
    before, after = (
        len(claim.answers(claim.measure(some, rollouts(runs, 0)))) for some in (runs, kept)
    )
    assert after == before * (len(SEEDS) - 1) / len(SEEDS)


TEXTS = dict.fromkeys(("name", "statement", "question", "measured", "border", "would_change"), "X")
ASKED = TEXTS | {"threshold": 0.5, "measure": None, "evidence": None}
GAINS, LOSSES, CONTRAST = (
    AtLeast(**ASKED),
    AtMost(**ASKED),
    Contrast(wrong="fell", worst="broke", **ASKED),
)
VALUES = pd.DataFrame({"one": np.linspace(0.1, 1.0, 10)})


def test_at_its_border_a_number_is_still_a_yes():
    values = pd.DataFrame({"one": [0.5]})
    assert GAINS.answers(values).all()
    assert LOSSES.answers(values).all()


def test_a_contrast_asks_the_first_arm_to_be_above_and_the_second_not():
    values = pd.DataFrame({"one": [0.6, 0.6, 0.5, np.nan], "other": [0.5, 0.6, 0.5, 0.5]})
    assert CONTRAST.answers(values).tolist() == [True, False, False]


def test_a_higher_border_is_harder_to_reach_and_easier_to_stay_below():
    borders = [0.05, 0.25, 0.55, 0.95, 1.05]
    gained, lost = (one.at_borders(VALUES, borders) for one in (GAINS, LOSSES))
    assert gained.share.tolist() == pytest.approx([1.0, 0.8, 0.5, 0.1, 0.0])
    assert lost.share.tolist() == pytest.approx([0.0, 0.2, 0.5, 0.9, 1.0])
    assert gained.outcome.tolist() == [REPRODUCED, PARTLY, PARTLY, NOT, NOT]
    assert ((gained.low <= gained.share) & (gained.share <= gained.high)).all()


def test_a_verdict_is_steady_if_a_border_half_and_twice_as_far_leave_it():
    assert LOSSES.steady(VALUES / 10)
    assert not LOSSES.steady(VALUES)
    ratios = replace(LOSSES, nothing=1.0)  # then 0.75 and 0 stand beside 0.5
    assert ratios.steady(VALUES + 1)
    assert not ratios.steady(0.5 + VALUES / 5)


def test_of_nothing_known_nothing_is_said():
    nothing = pd.DataFrame({"one": [np.nan]})
    assert GAINS.at_borders(nothing, [0.1, 0.5]).empty
    assert GAINS.steady(nothing)


def test_the_share_achieved_is_1_at_what_is_possible_0_at_theta_init_and_negative_beyond():
    runs = pd.DataFrame(
        {
            "layout": ["A", "A", "A", "A", "A", "A", "B", "C"],
            "initial_cost": 100.0,
            "final_cost": [80.0, 100.0, 90.0, 120.0, np.inf, 90.0, 90.0, 90.0],
            "stopped": ["finished"] * 5 + ["diverged: it went"] + ["finished"] * 2,
        }
    )
    shares = share_of_possible(runs, {"A": 0.2, "B": 0.0})
    worst = [-np.inf, -np.inf]
    np.testing.assert_allclose(shares, [1.0, 0.0, 0.5, -1.0, *worst, np.nan, np.nan], atol=1e-12)
