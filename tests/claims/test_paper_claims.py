"""Every verdict can come out each way, and thresholds are respected exactly at the border."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import pytest
from quiet_rows import START_COST, quiet_row

from nmpcrl.analysis.metrics import TOUCH
from nmpcrl.analysis.rows import experiment_of, row, table
from nmpcrl.analysis.statistics import rate
from nmpcrl.analysis.summary import summarise
from nmpcrl.claims import own_claims, paper_claims, thresholds
from nmpcrl.claims.assumptions import LINEAR, SMOOTH, THEOREMS
from nmpcrl.claims.by_runs import RunClaim
from nmpcrl.claims.robustness import part_changes, variant_changes
from nmpcrl.claims.rule import Assumption, Observations
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Verdict
from nmpcrl.claims.wider_claims import WIDER_CLAIMS, WIDER_THAN, judge_wider
from nmpcrl.study import Experiment, Runs, paper, run
from nmpcrl.study.experiment import LEARNERS, PAPER

SEEDS = range(5)
PLACE = np.zeros((3, 3))  # a rollout that stands still

Changes = Callable[[Experiment], dict[str, Any]]


def study(
    changes: Changes = lambda _: {}, *, learners=LEARNERS, layouts=("A",), **fields
) -> pd.DataFrame:
    """Runs with both readings and five seeds; `changes` says what is unlike in each."""
    named = [
        Experiment(learner, seed=seed, layout=layout, decay=decay, **fields)
        for learner, layout, decay, seed in product(learners, layouts, ("step", "episode"), SEEDS)
    ]
    return pd.DataFrame([quiet_row(one, **changes(one)) for one in named])


def of(learner: str, seeds=SEEDS, **columns: Any) -> Changes:
    """What is unlike in the runs of one learner with these seeds, in both readings."""
    return lambda e: columns if e.learner == learner and e.seed in seeds else {}


def both(*changes: Changes) -> Changes:
    return lambda e: {name: value for one in changes for name, value in one(e).items()}


def paths(runs: pd.DataFrame, apart: float = 0.0, seeds=SEEDS) -> dict[Experiment, np.ndarray]:
    """Rollouts that stand still, those of RDES with some seeds a step away [m]."""
    named = [experiment_of(one) for one in runs.to_dict("records")]
    away = {e: apart if e.learner == "RDES" and e.seed in seeds else 0.0 for e in named}
    return {e: PLACE + [away[e], 0, 0] for e in named}


def timings(rdes=0.5, ges=1.0, width=0.0, waited=0.0) -> pd.DataFrame:
    """Ratios of the times of a step, with intervals as wide on either side."""
    ratios = {"ES": 1.0, "RDES": rdes, "GES": ges}
    return pd.DataFrame(
        [
            {"solver": solver, "learner": learner, "ms_per_fit": 0.1, "waited": waited}
            | {"ratio": ratio, "ratio_low": ratio - width, "ratio_high": ratio + width}
            for solver in ("fatrop", "ipopt", "riccati")
            for learner, ratio in ratios.items()
        ]
    )


def judge(runs: pd.DataFrame) -> tuple[Verdict, ...]:
    broken = [Assumption("a finite MDP", "it is not", holds=False)]
    return paper_claims.judge(runs, paths=paths(runs), timings=timings(), assumptions=broken)


def verdict_on(name: str, *observed: Any, **others: Any) -> Verdict:
    """One verdict; what is observed as `Observations` takes it."""
    return EVERY[name].judge(Observations(*observed, **others))


EVERY = paper_claims.CLAIMS | own_claims.OWN_CLAIMS
SOME = range(2)  # of five seeds
BAD = {"cost_ratio": 1.6}
SWAYING = {"late_cost_range": 0.06}


# C1 and C2: a contrast between two learners

CONTRASTS = [
    (SEEDS, (), REPRODUCED),
    (SOME, (), PARTLY),
    (SEEDS, SOME, PARTLY),
    ((), (), NOT),
    (SEEDS, SEEDS, NOT),
    ((), SEEDS, NOT),
]


@pytest.mark.parametrize(("des", "rdes", "outcome"), CONTRASTS)
def test_c1_asks_in_how_many_pairs_des_diverged_and_rdes_did_not(des, rdes, outcome):
    runs = study(both(of("DES", des, **BAD), of("RDES", rdes, **BAD)))
    verdict = verdict_on("C1", runs)
    assert (verdict.claim, verdict.outcome) == ("C1", outcome)
    spared = [seed for seed in des if seed not in rdes]
    assert verdict.counts["all"] == (2 * len(spared), 10)


@pytest.mark.parametrize(("es", "ges", "outcome"), CONTRASTS)
@pytest.mark.parametrize("why", [SWAYING, BAD])  # what diverged is unstable, too
def test_c2_asks_in_how_many_pairs_es_was_unstable_and_ges_was_not(es, ges, outcome, why):
    verdict = verdict_on("C2", study(both(of("ES", es, **why), of("GES", ges, **why))))
    assert (verdict.claim, verdict.outcome) == ("C2", outcome)


@pytest.mark.parametrize(
    ("columns", "diverged"),
    [
        ({"cost_ratio": thresholds.DIVERGED}, False),
        ({"cost_ratio": np.nextafter(thresholds.DIVERGED, 2)}, True),
        ({"cost_ratio": np.inf}, True),
        ({"cost_ratio": 0.1, "stopped": "diverged: theta"}, True),
        ({"cost_ratio": np.nan, "stopped": "diverged: theta"}, True),
        ({"cost_ratio": np.nan}, pd.NA),
    ],
)
def test_a_run_diverged_if_it_was_stopped_or_cost_more_than_the_threshold(columns, diverged):
    judged = thresholds.divergence(study(of("DES", **columns), learners=("DES",)))
    expected = pd.Series([diverged] * len(judged), dtype="boolean")
    pd.testing.assert_series_equal(judged, expected, check_names=False)


@pytest.mark.parametrize(
    ("late_cost_range", "unstable"),
    [
        (thresholds.UNSTABLE, False),
        (np.nextafter(thresholds.UNSTABLE, 1), True),
        (np.inf, True),
    ],
)
def test_a_swing_of_exactly_the_threshold_is_stable(late_cost_range, unstable):
    judged = thresholds.instability(
        study(of("ES", late_cost_range=late_cost_range), learners=("ES",))
    )
    assert judged.unique().tolist() == [unstable]


def test_without_a_frozen_arm_nothing_is_said_of_divergence():
    runs = study(lambda _: {"cost_ratio": np.nan})
    outcomes = {v.claim: v.outcome for v in paper_claims.judge_runs(runs, paths(runs))}
    assert {c for c, outcome in outcomes.items() if outcome == UNDECIDABLE} == {"C1", "C2"}


# C3 and C4: ratios of times


@pytest.mark.parametrize(
    ("measured", "outcome"),
    [(0.39, PARTLY), (0.4, REPRODUCED), (0.6, REPRODUCED), (0.61, PARTLY), (1.0, NOT), (1.3, NOT)],
)
def test_c3_wants_half_of_the_time_with_the_paper_s_solver(measured, outcome):
    verdict = verdict_on("C3", timings=timings(rdes=measured))
    assert (verdict.claim, verdict.outcome) == ("C3", outcome)
    shown = f"{measured:.2f} [{measured:.2f}, {measured:.2f}]"
    assert f"{shown} with ipopt, {shown} with fatrop" in verdict.evidence
    assert (verdict.ratio, verdict.interval) == (measured, (measured, measured))


@pytest.mark.parametrize(
    ("measured", "outcome"),
    [(0.7, NOT), (0.85, PARTLY), (0.9, REPRODUCED), (1.1, REPRODUCED), (1.2, PARTLY), (1.25, NOT)],
)
def test_c4_wants_the_same_time(measured, outcome):
    verdict = verdict_on("C4", timings=timings(ges=measured))
    assert (verdict.claim, verdict.outcome) == ("C4", outcome)


@pytest.mark.parametrize(
    ("width", "waited", "outcome", "why"),
    [
        (0.01, 0.0, PARTLY, ""),
        (0.03, 0.0, UNDECIDABLE, "the interval reaches across a border"),
        (0.03, 0.5, UNDECIDABLE, "the machine was too busy"),
        (0.01, 0.5, PARTLY, ""),
        (0.01, 0.9, UNDECIDABLE, "the machine was too busy"),
    ],
)
def test_a_time_that_cannot_be_told_from_a_border_decides_nothing(width, waited, outcome, why):
    verdict = verdict_on("C3", timings=timings(0.62, width=width, waited=waited))
    assert verdict.outcome == outcome
    assert why in verdict.evidence


@pytest.mark.parametrize(
    "missing",
    [
        pd.DataFrame(),
        timings()[lambda t: t.solver != "ipopt"],
        timings()[lambda t: t.learner == "ES"],
    ],
)
def test_what_was_not_timed_with_the_paper_s_solver_is_not_decided(missing):
    assert verdict_on("C3", timings=missing).outcome == UNDECIDABLE
    assert verdict_on("C4", timings=missing).outcome == UNDECIDABLE


# C5: the same policy


@pytest.mark.parametrize(
    ("apart", "final", "seeds", "outcome"),
    [
        (0.0, START_COST, SEEDS, REPRODUCED),
        (thresholds.SAME_PATH, START_COST * (1 - thresholds.SAME_COST), SEEDS, REPRODUCED),
        (thresholds.SAME_PATH + 1e-9, START_COST, SEEDS, NOT),
        (0.0, START_COST * (1 - thresholds.SAME_COST) - 1e-9, SEEDS, NOT),
        (1.0, START_COST, SOME, PARTLY),
        (np.nan, np.inf, SEEDS, NOT),  # rollouts that failed
    ],
)
def test_c5_wants_the_same_path_and_the_same_cost(apart, final, seeds, outcome):
    runs = study(of("RDES", seeds, final_cost=final))
    verdict = verdict_on("C5", runs, paths(runs, apart, seeds))
    assert (verdict.claim, verdict.outcome) == ("C5", outcome)


def test_c5_compares_theta_and_does_not_judge_it():
    runs = study(of("RDES", theta_0=2.0))
    verdict = verdict_on("C5", runs, paths(runs))
    assert verdict.outcome == REPRODUCED
    assert "theta by up to 50% (medians)" in verdict.evidence


def test_two_policies_that_both_fail_are_not_the_same():
    runs = study(lambda _: {"final_cost": np.inf})
    failed = {e: np.full_like(PLACE, np.nan) for e in paths(runs)}
    assert verdict_on("C5", runs, failed).outcome == NOT


def test_a_run_that_had_to_be_stopped_left_no_policy_however_low_its_last_cost():
    runs = study(lambda _: {"final_cost": 500.0, "stopped": "diverged: theta"})
    outcomes = {v.claim: v.outcome for v in paper_claims.judge_runs(runs, paths(runs))}
    assert outcomes["C5"] == outcomes["C9"] == NOT
    runs = study(of("TDC", final_cost=500.0, stopped="diverged: theta"))
    assert verdict_on("B1", runs).outcome == NOT


def test_a_path_that_is_not_there_is_no_answer():
    runs = study()
    assert verdict_on("C5", runs, {}).outcome == UNDECIDABLE


def test_robots_are_as_far_apart_as_they_ever_come_whatever_their_headings():
    one, other = np.zeros((2, 4, 3))
    other[2], other[3] = (3.0, 4.0, 0.0), (0.0, 0.0, 9.0)
    assert thresholds.path_distance(one, other) == 5


# C6: the network


@pytest.mark.parametrize(
    ("told", "seeds", "outcome"),
    [
        (thresholds.MORE_ACCURATE, SEEDS, REPRODUCED),
        (np.nextafter(thresholds.MORE_ACCURATE, 1), SOME, PARTLY),
        (np.nextafter(thresholds.MORE_ACCURATE, 1), SEEDS, NOT),
        (np.nan, SEEDS, UNDECIDABLE),
    ],
)
def test_c6_wants_a_clearly_smaller_error(told, seeds, outcome):
    verdict = verdict_on("C6", study(of("RDES", seeds, imitation_with=told)))
    assert (verdict.claim, verdict.outcome) == ("C6", outcome)


# C7: constraints


@pytest.mark.parametrize(
    ("columns", "seeds", "outcome"),
    [
        ({}, SEEDS, REPRODUCED),
        ({"inside_small": 1}, SEEDS, PARTLY),
        ({"inside_large": 1}, SOME, PARTLY),
        ({"eval_inside_medium": 1, "eval_worst_overlap": 0.05}, SOME, PARTLY),
        ({"eval_inside_small": 1, "eval_worst_overlap": 0.005}, SEEDS, NOT),
        ({"eval_worst_overlap": TOUCH}, SEEDS, REPRODUCED),
        ({"inputs": 1}, SEEDS, NOT),
        ({"outside": 1}, SEEDS, REPRODUCED),  # the box is another constraint; it is counted
    ],
)
def test_c7_forgives_overlaps_in_training_in_part_and_no_others(columns, seeds, outcome):
    runs = study(lambda e: columns if e.seed in seeds else {})
    verdict = verdict_on("C7", runs)
    assert (verdict.claim, verdict.outcome) == ("C7", outcome)


def test_c7_counts_every_violation_by_size():
    sizes = {"inside_small": 7, "inside_medium": 2, "inside_large": 1, "eval_inside_large": 3}
    evidence = verdict_on("C7", study(of("RDES", **sizes, inputs=4, outside=6))).evidence
    assert "40 actions left" in evidence
    assert "70, 20 and 10 lay in an obstacle" in evidence
    assert "without noise 0, 0 and 30" in evidence
    assert "60 states in training lay outside the box" in evidence


@pytest.mark.parametrize("learner", sorted(LEARNERS))
def test_a_claim_is_of_whom_the_paper_speaks_and_the_wider_one_of_all_its_learners(learner):
    runs = study(of(learner, eval_inside_large=9, eval_worst_overlap=0.5, inputs=9, inside_large=9))
    wider = {v.claim: v for v in judge_wider(runs, paths(runs))}["W7"]
    assert (verdict_on("C7", runs).outcome == REPRODUCED) == (learner != "RDES")
    assert (wider.outcome == REPRODUCED) == (learner not in PAPER)


def test_a_wider_claim_asks_the_same_of_more_learners():
    for name, one in WIDER_CLAIMS.items():
        made = paper_claims.BY_RUNS[WIDER_THAN[name]]
        assert set(made.learners) < set(one.learners) == set(PAPER)
        assert (one.threshold, one.besides is None) == (made.threshold, made.besides is None)
        assert made.quotation
        assert not one.quotation
        assert not one.implied  # the paper does not take it for granted: it does not say it


@pytest.mark.parametrize("claim", paper_claims.CLAIMS.values(), ids=list(paper_claims.CLAIMS))
def test_a_claim_of_the_paper_quotes_it_and_says_where(claim):
    assert re.search(r"“.+”.*\((Section|Table) [IV]+(-[A-C])?\)|” hours", claim.quotation)


def test_only_the_claim_that_learning_helps_is_taken_for_granted():
    assert [name for name, one in paper_claims.CLAIMS.items() if one.implied] == ["C9"]


# C8: the theorem


@pytest.mark.parametrize(
    ("holds", "outcome"),
    [
        ({(SMOOTH, LINEAR): True, (SMOOTH,): True}, REPRODUCED),
        ({(SMOOTH, LINEAR): True, (SMOOTH,): False}, REPRODUCED),  # the other one applies
        ({(SMOOTH, LINEAR): False, (SMOOTH,): True}, NOT),
        ({(LINEAR,): False, (SMOOTH,): False}, NOT),
        ({}, UNDECIDABLE),
    ],
)
def test_c8_wants_every_assumption_of_one_theorem(holds, outcome):
    made = tuple(Assumption(f"{by}", "so", holds=one, by=by) for by, one in holds.items())
    verdict = verdict_on("C8", assumptions=made)
    assert (verdict.claim, verdict.outcome) == ("C8", outcome)
    assert all((f"{by}" in verdict.evidence) != one for by, one in holds.items())


def test_c8_counts_the_assumptions_of_each_theorem():
    made = (Assumption("a", "so", holds=False, by=THEOREMS), Assumption("b", "so", True, (SMOOTH,)))
    assert "1 of 2 of Maei et al. (2009) and 1 of 1 of Maei et al. (2010) do not hold" in (
        verdict_on("C8", assumptions=made).evidence
    )


# C9: better than not learning


@pytest.mark.parametrize(
    ("rdes", "ges", "outcome"),
    [
        (900.0, START_COST * (1 - thresholds.BETTER), REPRODUCED),
        (900.0, START_COST * (1 - thresholds.BETTER) + 1e-9, PARTLY),
        (1000.0, 1100.0, NOT),
        (np.inf, np.inf, NOT),
    ],
)
def test_c9_wants_both_methods_to_beat_the_frozen_theta(rdes, ges, outcome):
    runs = study(both(of("RDES", final_cost=rdes), of("GES", final_cost=ges)))
    verdict = verdict_on("C9", runs)
    assert (verdict.claim, verdict.outcome) == ("C9", outcome)
    assert verdict.counts["all"][1] == 20


def test_a_run_that_got_stuck_or_failed_is_said_to_be_so_and_counts():
    runs = study(both(of("RDES", (0,), final_cost=np.inf), of("GES", (1,), distance=5.0)))
    evidence = verdict_on("C9", runs).evidence
    assert "2 end more than 0.5 away" in evidence
    assert "in 2 runs one of the last three failed or training was stopped" in evidence


# All of them


def test_nine_claims_are_judged_in_order_and_each_says_what_it_rests_on():
    verdicts = judge(study())
    assert (
        [v.claim for v in verdicts] == [f"C{i}" for i in range(1, 10)] == list(paper_claims.CLAIMS)
    )
    assert all(v.statement and v.evidence and v.would_change for v in verdicts)
    assert {v.outcome for v in verdicts} <= {REPRODUCED, PARTLY, NOT, UNDECIDABLE}


def test_every_claim_says_beforehand_what_is_asked_and_where_the_border_is():
    for claim in EVERY.values():
        texts = (claim.statement, claim.measured, claim.border, claim.test, claim.would_change)
        assert all(texts), claim.name
        assert claim.question.endswith("?")
        if isinstance(claim, RunClaim):
            assert claim.learners
            assert claim.label


def test_what_is_drawn_of_a_claim_has_its_border_within_what_is_tried():
    for claim in paper_claims.BY_RUNS.values():
        assert claim.short
        assert claim.borders[0] < claim.threshold < claim.borders[-1]
        assert (np.diff(claim.borders) > 0).all()


RUNS_DECIDE = {"C1", "C2", "C5", "C6", "C7", "C9"}


def test_runs_shorter_than_the_paper_s_decide_nothing_about_learning():
    outcomes = {v.claim: v.outcome for v in judge(study(episodes=paper.EPISODES - 1))}
    assert {c for c, outcome in outcomes.items() if outcome == UNDECIDABLE} == RUNS_DECIDE


def test_without_runs_nothing_is_decided():
    runs = study()
    verdicts = paper_claims.judge_runs(runs[runs.learner == "frozen"], {})
    assert {v.claim for v in verdicts} == RUNS_DECIDE
    assert {v.outcome for v in verdicts} == {UNDECIDABLE}


@pytest.mark.parametrize(
    ("absent", "open_"),
    [
        ("ES", {"C2"}),
        ("DES", {"C1"}),
        ("RDES", {"C1", "C5", "C6", "C7", "C9"}),
        ("GES", {"C2", "C5", "C9"}),
        ("frozen", set()),  # its costs are in the table already
    ],
)
def test_a_claim_about_a_learner_that_was_not_run_is_not_decided(absent, open_):
    runs = study()
    verdicts = paper_claims.judge_runs(runs[runs.learner != absent], paths(runs))
    assert {v.claim for v in verdicts if v.outcome == UNDECIDABLE} == open_


def test_layouts_may_differ_and_are_judged_one_by_one():
    def worse(e):
        return BAD if e.learner == "DES" and e.layout == "B" else {}

    verdict = verdict_on("C1", study(worse, layouts=("A", "B")))
    assert verdict.by_layout == {"A": NOT, "B": REPRODUCED}
    assert verdict.outcome == PARTLY
    assert verdict.interval == (rate(10, 20).low, rate(10, 20).high)


def test_what_could_not_be_finished_is_shown_as_infinite_and_never_as_inf():
    lost = {"final_cost": np.inf, "cost_ratio": np.inf, "late_cost_range": np.inf}
    runs = study(lambda _: lost)
    evidence = [v.evidence for v in (*judge(runs), *own_claims.judge_own(runs))]
    assert not any("inf" in sentence for sentence in evidence)
    assert "ended at ∞ and ∞ times" in evidence[0]


# One run, from its records


@pytest.fixture(scope="module")
def short():
    experiments = [Experiment(name, episodes=4, steps=6) for name in (*PAPER, "frozen")]
    experiments.append(Experiment("ES", alpha=1e5, seed=1, episodes=4, steps=6))
    experiments.append(Experiment("frozen", seed=1, episodes=4, steps=6))
    return Runs({one: run(one) for one in experiments})


def test_a_run_is_judged_from_its_records_as_from_the_table(short):
    runs = table([summarise(records) for records in short.values()])
    for rule, measured in (
        (thresholds.diverged, thresholds.divergence(runs)),
        (thresholds.unstable, thresholds.instability(runs)),
    ):
        judged = [rule(short, *pair) for pair in short.items()]
        assert judged == measured.tolist()
        assert set(judged) == {True, False}


@pytest.mark.parametrize(
    ("dear", "lost", "expected"),
    [
        ((), {"frozen": 1}, False),
        (("ES",), {"frozen": 1}, True),  # the frozen arm's other episodes are the reference
        (("ES",), {"frozen": 3}, False),  # the frozen arm did worse
        ((), {"frozen": 3, "ES": 3}, pd.NA),  # nothing to compare it with
    ],
)
def test_a_run_is_judged_alike_where_its_frozen_arm_lost_late_episodes(dear, lost, expected):
    found = {}
    for learner in ("ES", "frozen"):
        records = run(Experiment(learner, episodes=6, steps=6))
        failed = records.steps["episode"] >= 6 - lost.get(learner, 0)
        steps = {
            "status": np.where(failed, 2, records.steps["status"]),
            "cost": records.steps["cost"] * (10 if learner in dear else 1),
        }
        changed = replace(records, steps=records.steps | steps)
        found[Experiment(learner, episodes=6, steps=6)] = changed
    runs = table([summarise(records) for records in found.values()])
    assert thresholds.divergence(runs)[runs.learner == "ES"].tolist() == [expected]
    (es, records), _ = found.items()
    assert thresholds.diverged(Runs(found), es, records) == (expected is True)


def test_a_row_of_the_table_names_its_experiment(short):
    for experiment, records in short.items():
        runs = pd.DataFrame([row(summarise(records))])
        (one,) = runs.to_dict("records")
        assert experiment_of(one) == experiment


# What we add


@pytest.mark.parametrize(
    ("claim", "learner", "against", "border"),
    [
        ("B1", "TDC", "GES", 1 + thresholds.SAME_COST),
        ("B2", "ES", "random", 1 - thresholds.BETTER),
        (
            "B3",
            "matched",
            "GES",
            1 + thresholds.SAME_COST,
        ),
        ("B4", "QL", "ES", 1 + thresholds.SAME_COST),
    ],
)
def test_an_addition_holds_up_to_its_border_and_not_beyond(claim, learner, against, border):
    for cost, outcome in ((border, REPRODUCED), (border + 1e-9, NOT)):
        runs = study(of(learner, final_cost=cost * START_COST))
        assert verdict_on(claim, runs).outcome == outcome
    some = study(of(learner, SOME, final_cost=border * START_COST + 20))
    assert verdict_on(claim, some).outcome == (NOT if learner == "ES" else PARTLY)
    assert verdict_on(claim, runs[runs.learner != learner]).outcome == UNDECIDABLE
    assert verdict_on(claim, runs[runs.learner != against]).outcome == UNDECIDABLE


def test_a_learner_that_ends_alike_may_not_end_at_a_lower_cost_either():
    runs = study(of("matched", final_cost=(1 - thresholds.SAME_COST) * START_COST - 1e-9))
    assert verdict_on("B3", runs).outcome == NOT


def test_of_two_failures_none_is_better_and_none_is_worse():
    runs = study(lambda _: {"final_cost": np.inf})
    outcomes = {v.claim: v.outcome for v in own_claims.judge_own(runs)}
    expected = {"B1": REPRODUCED, "B2": NOT, "B3": REPRODUCED, "B4": REPRODUCED}
    assert outcomes | expected == outcomes


def test_an_addition_is_judged_where_its_learner_was_run():
    runs = study(layouts=("A", "B"))
    verdict = verdict_on("B2", runs[(runs.learner != "random") | (runs.layout == "B")])
    assert verdict.by_layout == {"B": NOT}


def test_a_run_costs_less_with_the_probability_that_counts_every_pair_alike():
    runs = study(of("TDC", final_cost=900.0))
    assert own_claims.costs_less(runs, "TDC", "GES").value == 1
    assert own_claims.costs_less(runs, "GES", "TDC").value == 0


def test_the_evidence_of_an_addition_has_the_probability_of_improvement():
    runs = study(of("TDC", final_cost=900.0))
    evidence = verdict_on("B1", runs).evidence
    assert "TDC costs less than one of GES with probability 1.00 [1.00, 1.00]" in evidence
    assert "reduced by +10.0% and +0.0%" in evidence


# What verdicts depend on


def varied(main: pd.DataFrame, **variants: pd.DataFrame) -> pd.DataFrame:
    parts = {"main": main} | variants
    return pd.concat([runs.assign(variant=name) for name, runs in parts.items()])


def one(frame: pd.DataFrame, variant: str, claim: str) -> pd.Series:
    (found,) = frame[(frame.variant == variant) & (frame.claim == claim)].itertuples()
    return found


def test_a_variant_changes_the_claims_whose_outcome_it_changes():
    hot = study(of("DES", **BAD), learners=PAPER, alpha=3e-7)
    runs = varied(study(), hot=hot)
    frame = variant_changes(runs, paths(runs))
    assert set(frame.claim) == RUNS_DECIDE
    assert frame[frame.changes].claim.tolist() == ["C1"]
    changed = one(frame, "hot", "C1")
    assert (changed.base, changed.outcome, changed.base_share, changed.share) == (
        NOT,
        REPRODUCED,
        0,
        1,
    )
    assert changed.p == pytest.approx(2 / 184756)  # two of the 20 over 10 ways to deal them out
    assert one(frame, "hot", "C2").p == 1


def test_a_claim_about_learners_that_a_variant_does_not_change_cannot_change():
    runs = varied(study(), slow=study(learners=("GES",), beta=1e-6))
    assert set(variant_changes(runs, paths(runs)).claim) == {"C2", "C5", "C9"}


@cache
def outcomes(learners: frozenset[str]) -> dict[str, str]:
    """Of every claim, from the runs of these learners alone; asked for by many claims."""
    runs = study(lambda e: BAD if e.learner in ("DES", "ES", "matched", "QL") else {})
    some = runs[runs.learner.isin(learners)]
    return {v.claim: v.outcome for v in (*judge(some), *own_claims.judge_own(some))}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(RUNS_DECIDE | set(own_claims.OWN_CLAIMS)))
def test_those_whom_a_claim_asks_decide_it(name):
    everybody, asked = frozenset(LEARNERS), frozenset(EVERY[name].learners)
    assert outcomes(asked)[name] == outcomes(everybody)[name] != UNDECIDABLE
    for learner in asked:
        assert outcomes(everybody - {learner})[name] == UNDECIDABLE


def test_what_is_undecided_changes_nothing():
    runs = varied(study(), cut=study(learners=PAPER, episodes=10))
    frame = variant_changes(runs, paths(runs))
    assert set(frame.outcome) == {UNDECIDABLE}
    assert not frame.changes.any()


def test_controls_are_no_variant_of_the_paper_s_claims():
    runs = varied(study(learners=PAPER), controls=study(learners=("random", "QL")))
    assert variant_changes(runs, paths(runs)).empty


def test_layouts_and_readings_are_shown_as_variants_are():
    def worse(e):
        return BAD if e.learner == "DES" and e.layout == "B" else {}

    runs = study(worse, layouts=("A", "B"))
    frame = part_changes(judge(runs))
    assert list(frame.columns) == list(variant_changes(varied(runs), {}).columns)
    assert frame[frame.claim == "C1"].variant.tolist() == [
        "layout A",
        "layout B",
        "decay per step",
        "decay per episode",
    ]
    cell = one(frame, "layout B", "C1")
    assert (cell.outcome, cell.base, cell.changes) == (REPRODUCED, PARTLY, True)
    assert (cell.share, cell.base_share, cell.pairs) == (1, 0, 10)
    assert not set(frame.claim) & {"C3", "C4", "C8"}


def test_a_setting_is_judged_at_a_time():
    runs = study()
    two = pd.concat([runs, study(alpha=3e-7)])
    with pytest.raises(ValueError, match="DES has several runs in layout A"):
        paper_claims.judge_runs(two, paths(two))


def test_nudged_runs_keep_every_digit_of_their_theta():
    theta = tuple(np.nextafter(paper.THETA_INIT, 9))
    perturbed = replace(Experiment(), theta=tuple(map(float, theta)))
    assert experiment_of(quiet_row(perturbed)) == perturbed
