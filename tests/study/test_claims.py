"""Every verdict can come out each way, and thresholds are respected exactly at the border."""

from dataclasses import asdict
from itertools import product

import numpy as np
import pandas as pd
import pytest

from nmpcrl.study import Experiment, Study, claims, paper
from nmpcrl.study.audit import Assumption
from nmpcrl.study.claims import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.study.imitation import Imitation
from nmpcrl.study.records import Records

FROZEN_COST = 100.0  # training cost of an episode of the frozen arm
START_COST = 1000.0  # noise-free cost of theta_init
FAR = (-2.0, -2.0, 0.0)  # a state far from all obstacles


def records(
    experiment: Experiment,
    *,
    training=FROZEN_COST,
    judged=START_COST,
    path=0.0,
    stopped="finished",
    inside=False,
    rollout_inside=False,
    action=(0.0, 0.0),
) -> Records:
    """A run of one-step episodes that only a claim could tell from a real one."""
    n = experiment.episodes
    state = np.tile(FAR, (n, 1))
    if inside:
        state[0, :2] = paper.LAYOUTS["A"][0]
    late = np.broadcast_to(np.array(judged, float), 4)  # the rollouts of the second half
    states = np.tile(FAR, (5, 2, 1))
    states[-1, :, 0] += path
    if rollout_inside:
        states[-1, 0, :2] = paper.LAYOUTS["A"][0]
    steps = {
        "episode": np.arange(n),
        "cost": np.full(n, float(training)),
        "status": np.zeros(n, int),
        "state": state,
        "action": np.tile(action, (n, 1)).astype(float),
        "theta": np.ones((n, 9)),
    }
    evaluations = {
        "episode": np.append(0, np.linspace(n / 2, n, 4).astype(int)),
        "cost": np.append(START_COST, late),
        "states": states,
        "actions": np.zeros((5, 2, 2)),
    }
    asked = asdict(experiment) | {"steps": 1}
    return Records(asked, steps, evaluations, {"stopped": stopped})


def study(runs: dict, *, seeds=(0, 1), episodes=paper.EPISODES) -> Study:
    """The main study with one reading; `runs` says what differs: {learner: [options a seed]}."""
    made = {}
    for learner, seed in product(("ES", "DES", "RDES", "GES", "frozen"), seeds):
        experiment = Experiment(learner=learner, seed=seed, episodes=episodes)
        options = runs.get(learner, [{}] * len(seeds))[seeds.index(seed)]
        made[experiment] = records(experiment, **options)
    return Study(made)


def timings(rdes=0.5, ges=1.0) -> pd.DataFrame:
    """Times of a step, ES taking 1 ms."""
    per_step = {"ES": 1.0, "RDES": rdes, "GES": ges}
    return pd.DataFrame(
        [
            {"solver": solver, "learner": learner, "ms_per_step": ms, "ms_per_fit": 0.1}
            for solver in ("ipopt", "fatrop", "riccati")
            for learner, ms in per_step.items()
        ]
    )


def imitation(ratio: float) -> Imitation:
    """Two networks whose errors are `ratio` and 1."""
    zero = np.zeros(2)
    return Imitation(
        episode=zero, value=zero, without_theta=np.ones(2), with_theta=np.full(2, ratio)
    )


def assumption(*, holds: bool) -> Assumption:
    return Assumption("a finite MDP", "it is not", holds=holds)


BAD, FINE = {"training": 1.6 * FROZEN_COST}, {}


# C1 and C2: a contrast between two learners


@pytest.mark.parametrize(
    ("des", "rdes", "outcome"),
    [
        ([BAD, BAD], [FINE, FINE], REPRODUCED),
        ([BAD, FINE], [FINE, FINE], PARTLY),
        ([BAD, BAD], [BAD, FINE], PARTLY),
        ([FINE, FINE], [FINE, FINE], NOT),
        ([BAD, BAD], [BAD, BAD], NOT),
        ([FINE, FINE], [BAD, BAD], NOT),
    ],
)
def test_c1_compares_how_many_runs_of_des_and_rdes_diverged(des, rdes, outcome):
    verdict = claims.des_diverges_and_rdes_does_not(study({"DES": des, "RDES": rdes}))
    assert (verdict.claim, verdict.outcome) == ("C1", outcome)


def test_a_run_at_the_threshold_has_not_diverged_and_one_just_above_has():
    border = {"training": claims.DIVERGED * FROZEN_COST}
    above = {"training": np.nextafter(claims.DIVERGED * FROZEN_COST, np.inf)}
    runs = study({"DES": [border, above]})
    judged = [claims.diverged(runs, *pair) for pair in runs.select(learner="DES").items()]
    assert judged == [False, True]


def test_a_run_that_had_to_be_stopped_diverged_however_low_its_cost():
    runs = study({"DES": [{"stopped": "diverged: theta", "training": 1.0}, FINE]})
    judged = [claims.diverged(runs, *pair) for pair in runs.select(learner="DES").items()]
    assert judged == [True, False]


def test_a_run_most_of_whose_last_episodes_were_cut_short_diverged():
    runs = study({})
    (experiment, run) = next(iter(runs.select(learner="RDES").items()))
    run.steps["status"][-9:] = 2
    assert not claims.diverged(runs, experiment, run)  # the median of the last 20 is a whole one
    run.steps["status"][-11:] = 2
    assert claims.diverged(runs, experiment, run)


@pytest.mark.parametrize(
    ("es", "ges", "outcome"),
    [
        ({"judged": (1000, 900, 1000, 1000)}, {}, REPRODUCED),
        ({}, {}, NOT),
        ({}, {"judged": (1000, 900, 1000, 1000)}, NOT),
        (BAD, {}, REPRODUCED),  # what diverged is unstable, too
    ],
)
def test_c2_compares_how_many_runs_of_es_and_ges_were_unstable(es, ges, outcome):
    verdict = claims.es_is_unstable_and_ges_is_stable(study({"ES": [es] * 2, "GES": [ges] * 2}))
    assert (verdict.claim, verdict.outcome) == ("C2", outcome)


@pytest.mark.parametrize(("swing", "unstable"), [(0.05, False), (0.0501, True)])
def test_a_swing_of_exactly_the_threshold_is_stable(swing, unstable):
    low = START_COST * (1 - swing)
    runs = study({"ES": [{"judged": (START_COST, low, START_COST, START_COST)}] * 2})
    pair = next(iter(runs.select(learner="ES").items()))
    assert claims.unstable(runs, *pair) == unstable


def test_a_run_whose_late_rollouts_all_failed_is_unstable():
    runs = study({"GES": [{"judged": np.inf}] * 2})
    pair = next(iter(runs.select(learner="GES").items()))
    assert claims.unstable(runs, *pair)


# C3 and C4: ratios of times


@pytest.mark.parametrize(
    ("measured", "outcome"),
    [(0.39, PARTLY), (0.4, REPRODUCED), (0.6, REPRODUCED), (0.61, PARTLY), (1.0, NOT), (1.3, NOT)],
)
def test_c3_wants_half_of_the_time_with_the_paper_s_solver(measured, outcome):
    verdict = claims.rdes_takes_half_the_time(timings(rdes=measured))
    assert (verdict.claim, verdict.outcome) == ("C3", outcome)


@pytest.mark.parametrize(
    ("measured", "outcome"),
    [(0.7, NOT), (0.85, PARTLY), (0.9, REPRODUCED), (1.1, REPRODUCED), (1.2, PARTLY), (1.25, NOT)],
)
def test_c4_wants_the_same_time(measured, outcome):
    verdict = claims.ges_takes_the_same_time(timings(ges=measured))
    assert (verdict.claim, verdict.outcome) == ("C4", outcome)


# C5: the same policy


@pytest.mark.parametrize(
    ("rdes", "outcome"),
    [
        ([{}, {}], REPRODUCED),
        ([{"path": claims.SAME_PATH}] * 2, REPRODUCED),
        ([{"path": claims.SAME_PATH + 1e-9}, {}], PARTLY),
        ([{"path": 1.0}, {"judged": 900.0}], NOT),
        ([{"judged": START_COST * (1 - claims.SAME_COST)}] * 2, REPRODUCED),
        ([{"judged": 980.0}] * 2, NOT),
        ([{"path": np.nan}] * 2, NOT),  # a rollout that failed
    ],
)
def test_c5_wants_the_same_path_and_the_same_cost_in_every_pair(rdes, outcome):
    verdict = claims.rdes_and_ges_reach_the_same_policy(study({"RDES": rdes}))
    assert (verdict.claim, verdict.outcome) == ("C5", outcome)


# C6: the network


@pytest.mark.parametrize(
    ("ratios", "outcome"),
    [
        ((0.8, 0.5), REPRODUCED),
        ((0.81, 0.5), PARTLY),
        ((0.9, 0.9), PARTLY),
        ((1.0, 1.0), NOT),
        ((1.5, 0.7), NOT),
    ],
)
def test_c6_wants_a_smaller_error_in_every_run(ratios, outcome):
    verdict = claims.theta_makes_the_network_more_accurate(
        study({}), tuple(imitation(ratio) for ratio in ratios)
    )
    assert (verdict.claim, verdict.outcome) == ("C6", outcome)


# C7: constraints


@pytest.mark.parametrize(
    ("rdes", "outcome"),
    [
        ({}, REPRODUCED),
        ({"inside": True}, PARTLY),
        ({"rollout_inside": True}, NOT),
        ({"action": (0.7, 0.0)}, NOT),
        ({"action": (0.6, -np.pi / 2)}, REPRODUCED),
    ],
)
def test_c7_forgives_overlaps_in_training_only(rdes, outcome):
    verdict = claims.constraints_hold(study({"RDES": [rdes, {}]}))
    assert (verdict.claim, verdict.outcome) == ("C7", outcome)


def test_the_frozen_arm_is_not_asked_to_keep_constraints():
    verdict = claims.constraints_hold(study({"frozen": [{"inside": True}] * 2}))
    assert verdict.outcome == REPRODUCED


# C8: the theorem


@pytest.mark.parametrize(("holds", "outcome"), [(True, REPRODUCED), (False, NOT)])
def test_c8_wants_every_assumption(holds, outcome):
    verdict = claims.convergence_is_guaranteed((assumption(holds=True), assumption(holds=holds)))
    assert (verdict.claim, verdict.outcome) == ("C8", outcome)


# C9: better than not learning


@pytest.mark.parametrize(
    ("rdes", "ges", "outcome"),
    [
        (900.0, 900.0, REPRODUCED),
        (START_COST * (1 - claims.BETTER), 900.0, REPRODUCED),
        (995.0, 900.0, PARTLY),
        (1000.0, 1100.0, NOT),
        (np.inf, np.inf, NOT),
    ],
)
def test_c9_wants_both_methods_to_beat_the_frozen_theta(rdes, ges, outcome):
    runs = study({"RDES": [{"judged": rdes}] * 2, "GES": [{"judged": ges}] * 2})
    verdict = claims.learning_beats_the_frozen_theta(runs)
    assert (verdict.claim, verdict.outcome) == ("C9", outcome)


# All of them


def judge(runs: Study) -> tuple[claims.Verdict, ...]:
    return claims.judge(runs, timings(), [imitation(0.5)] * 2, [assumption(holds=False)])


def test_nine_claims_are_judged_in_order_and_each_says_what_it_rests_on():
    verdicts = judge(study({}))
    assert [v.claim for v in verdicts] == [f"C{i}" for i in range(1, 10)]
    assert all(v.statement and v.evidence and v.would_change for v in verdicts)
    assert {v.outcome for v in verdicts} <= {REPRODUCED, PARTLY, NOT, UNDECIDABLE}


def test_runs_shorter_than_the_paper_s_decide_nothing_about_learning():
    outcomes = {v.claim: v.outcome for v in judge(study({}, episodes=paper.EPISODES - 1))}
    assert {c for c, outcome in outcomes.items() if outcome == UNDECIDABLE} == {
        "C1",
        "C2",
        "C5",
        "C6",
        "C7",
        "C9",
    }


def test_one_seed_is_enough_to_judge_and_the_evidence_says_that_it_is_one():
    first = judge(study({}, seeds=(0,)))[0]
    assert "1 layout, 1 seed, 1 reading of the decay; 300 episodes" in first.evidence


def test_what_could_not_be_finished_is_shown_as_infinite_and_never_as_inf():
    run = {"judged": np.inf}
    runs = study({"DES": [run, run]})
    for records_ in runs.select(learner="DES").values():
        records_.steps["status"][-11:] = 2
    evidence = [verdict.evidence for verdict in judge(runs)]
    assert not any("inf" in sentence for sentence in evidence)
    assert "ended at ∞ and" in evidence[0]
    assert "DES -∞" in evidence[-1]
